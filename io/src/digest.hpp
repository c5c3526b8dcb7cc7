// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>

#include "radiosity/meshing/symmetry.hpp"

namespace radiosity {

/// A hash of values in their order: FNV-1a, eight bytes at a time. −0 counts as 0.
class Digest {
 public:
  void add(std::uint64_t word) {
    state_ = (state_ ^ word) * 0x100000001B3;
    state_ ^= state_ >> 29;
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value + 0.0)); }
  void add(Index value) { add(static_cast<std::uint64_t>(value)); }
  void add(const BandValues& values) {
    add(static_cast<std::uint64_t>(values.size()));
    for (const double value : values) add(value);
  }
  void add(const std::string& text) {
    add(static_cast<std::uint64_t>(text.size()));
    for (const char c : text) add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  }
  void add(const Symmetry& symmetry) {
    if (symmetry.none()) return;
    for (const auto& [axis, offset] : symmetry.planes) add(Index{axis}), add(offset);
    for (const double c : symmetry.period) add(c);
    add(symmetry.steps);
  }
  template <class T>
  void add_optional(const std::optional<T>& value) {
    add(static_cast<std::uint64_t>(value.has_value()));
    if (!value) return;
    if constexpr (std::is_same_v<T, bool>)
      add(static_cast<std::uint64_t>(*value));
    else
      add(*value);
  }
  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0xCBF29CE484222325;
};

}  // namespace radiosity
