// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// The processes of a distributed run, told apart by their ranks. Each computes and keeps the rows of F that it owns, dealt out in
/// turn in blocks of kBlock; vectors of n values are whole on each. Nothing is ever summed over ranks in floating point: each value
/// is computed by one of them as one process alone would, so the bits of a result do not depend on how many there are.
///
/// Every function but count, rank and owner is collective: all ranks call it, in the same order.
class Ranks {
 public:
  /// Rows. Few: neighbours cost alike, and are shared by as many ranks as can be.
  static constexpr Index kBlock = 4;

  virtual ~Ranks() = default;
  virtual int count() const = 0;
  virtual int rank() const = 0;

  int owner(Index row) const { return static_cast<int>(row / kBlock % static_cast<Index>(count())); }
  bool owns(Index row) const { return owner(row) == rank(); }
  /// Rows of n that rank r owns.
  Index rows_of(int r, Index n) const;

  /// Fills in, from their owners, what others own of an array of rows × width values, one row after the other.
  void gather(double* values, Index rows, Index width) const;
  template <class Array>
  void gather(Array& x) const {
    gather(x.data(), static_cast<Index>(x.rows()), static_cast<Index>(x.cols()));
  }

  /// `values` becomes the sum over the ranks.
  virtual void sum(std::span<std::uint64_t> values) const = 0;
  /// What each rank gives, in the order of the ranks; counts: how many values each of them has.
  virtual void all_gather(std::span<const double> own, std::span<const int> counts,
                          std::span<double> all) const = 0;
  /// to[r] goes to rank r; from[r] becomes what came from there, of this rank nothing. Less than 2³¹ bytes between any two.
  virtual void exchange(std::span<const std::span<const std::byte>> to,
                        std::vector<std::vector<std::byte>>& from) const = 0;
};

// Of a run of one process, `ranks` is null: it owns all rows, and is of one mind with itself.
inline bool owns(const Ranks* ranks, Index row) {
  return ranks == nullptr || ranks->owns(row);
}
template <class Array>
void gather(const Ranks* ranks, Array& x) {
  if (ranks != nullptr) ranks->gather(x);
}
/// Whether it is so on all ranks.
bool on_all(const Ranks* ranks, bool so);
/// Of a whole number that each rank counted for itself.
std::uint64_t total(const Ranks* ranks, std::uint64_t own);
/// What each has of a number, in their order. Of clocks and memories, all take that of rank 0 or the least: they must decide alike.
std::vector<double> of_all(const Ranks* ranks, double own);

}  // namespace radiosity
