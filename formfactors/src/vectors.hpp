// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

/// Vectors of 64 bytes in parts as wide as the registers of the processor that a source is built for; wider ones the compiler
/// would take apart number by number. For the sources that are built once for each level of processors: all is local to them, so that
/// nothing of a higher level is linked into the others. Without fused multiply-add every level gives the same bits.
namespace radiosity {
namespace {

#if defined(__AVX512F__)
constexpr std::size_t kBytes = 64;
#elif defined(__AVX__)
constexpr std::size_t kBytes = 32;
#else
constexpr std::size_t kBytes = 16;
#endif
constexpr std::size_t kParts = 64 / kBytes;

template <class T>
struct MaskOf {
  using Number = T;
};
template <>
struct MaskOf<float> {
  using Number = std::int32_t;
};
template <>
struct MaskOf<double> {
  using Number = std::int64_t;
};

template <class T>
struct Vector {
  typedef T Part __attribute__((vector_size(kBytes)));
  using Mask = Vector<typename MaskOf<T>::Number>;  // of bits all set or none

  Part part[kParts];

  Vector() = default;
  Vector(T x) : Vector(each([x](auto zero) { return x - zero; }, Vector{})) {}  // in every lane

  // Unrolled by a pack: arrays that loops index stay in memory.
  template <class F, class... A>
  static Vector each(F f, const A&... a) {
    return all(std::make_index_sequence<kParts>(), f, a...);
  }

  friend Vector operator+(const Vector& a, const Vector& b) {
    return each([](auto x, auto y) { return x + y; }, a, b);
  }
  friend Vector operator-(const Vector& a, const Vector& b) {
    return each([](auto x, auto y) { return x - y; }, a, b);
  }
  friend Vector operator*(const Vector& a, const Vector& b) {
    return each([](auto x, auto y) { return x * y; }, a, b);
  }
  friend Vector operator/(const Vector& a, const Vector& b) {
    return each([](auto x, auto y) { return x / y; }, a, b);
  }
  friend Vector operator-(const Vector& a) {
    return each([](auto x) { return -x; }, a);
  }
  friend Vector operator&(const Vector& a, const Vector& b) {
    return each([](auto x, auto y) { return x & y; }, a, b);
  }
  friend Vector operator|(const Vector& a, const Vector& b) {
    return each([](auto x, auto y) { return x | y; }, a, b);
  }
  friend Vector operator^(const Vector& a, const Vector& b) {
    return each([](auto x, auto y) { return x ^ y; }, a, b);
  }
  friend Vector operator~(const Vector& a) {
    return each([](auto x) { return ~x; }, a);
  }
  Vector& operator+=(const Vector& b) { return *this = *this + b; }
  Vector& operator&=(const Vector& b) { return *this = *this & b; }
  Vector& operator|=(const Vector& b) { return *this = *this | b; }

  friend Vector operator>>(const Vector& a, int bits) {
    return each([bits](auto x) { return x >> bits; }, a);
  }

  friend Mask operator<(const Vector& a, const Vector& b) {
    return Mask::each([](auto x, auto y) { return x < y; }, a, b);
  }
  friend Mask operator>(const Vector& a, const Vector& b) { return b < a; }
  friend Mask operator>=(const Vector& a, const Vector& b) {
    return Mask::each([](auto x, auto y) { return x >= y; }, a, b);
  }
  friend Mask operator==(const Vector& a, const Vector& b) {
    return Mask::each([](auto x, auto y) { return x == y; }, a, b);
  }

  friend Vector select(const Mask& mask, const Vector& a, const Vector& b) {
    return each([](auto m, auto x, auto y) { return m ? x : y; }, mask, a, b);
  }
  friend Vector min(const Vector& a, const Vector& b) {
    return each([](auto x, auto y) { return x < y ? x : y; }, a, b);
  }
  friend Vector max(const Vector& a, const Vector& b) {
    return each([](auto x, auto y) { return x > y ? x : y; }, a, b);
  }
  friend Vector abs(const Vector& a) { return max(a, -a); }

 private:
  template <std::size_t k, class F, class... A>
  static auto one(F f, const A&... a) {
    return f(a.part[k]...);
  }
  template <std::size_t... k, class F, class... A>
  static Vector all(std::index_sequence<k...>, F f, const A&... a) {
    Vector out;
    ((out.part[k] = one<k>(f, a...)), ...);
    return out;
  }
};

using Floats = Vector<float>;
using Ints = Vector<std::int32_t>;
using Doubles = Vector<double>;
using Longs = Vector<std::int64_t>;

/// The same bits.
template <class To, class From>
inline To as(const From& from) {
  return To::each([](auto x) { return reinterpret_cast<typename To::Part>(x); }, from);
}
// Part by part: whole structs would be copied through general registers.
template <class T>
inline Vector<T> load(const T* from) {
  Vector<T> out;
  for (std::size_t k = 0; k < kParts; ++k)
    __builtin_memcpy(&out.part[k], from + k * kBytes / sizeof(T), kBytes);
  return out;
}
template <class T>
inline void store(T* to, const Vector<T>& from) {
  for (std::size_t k = 0; k < kParts; ++k)
    __builtin_memcpy(to + k * kBytes / sizeof(T), &from.part[k], kBytes);
}

/// Bit k is set where the mask is, in lane k.
template <class T>
inline std::uint32_t lane_bits(const Vector<T>& mask) {
  constexpr std::size_t kPartLanes = kBytes / sizeof(T);
  std::uint32_t bits = 0;
  for (std::size_t k = 0; k < kParts; ++k) {
    constexpr bool kShort = sizeof(T) == sizeof(float);
    std::uint32_t part = 0;
#if defined(__AVX512F__)
    part = kShort ? __builtin_ia32_cvtd2mask512(reinterpret_cast<Ints::Part>(mask.part[k]))
                  : __builtin_ia32_cvtq2mask512(reinterpret_cast<Vector<long long>::Part>(mask.part[k]));
#elif defined(__AVX__)
    part = static_cast<std::uint32_t>(
        kShort ? __builtin_ia32_movmskps256(reinterpret_cast<Floats::Part>(mask.part[k]))
               : __builtin_ia32_movmskpd256(reinterpret_cast<Doubles::Part>(mask.part[k])));
#elif defined(__SSE2__)
    part = static_cast<std::uint32_t>(
        kShort ? __builtin_ia32_movmskps(reinterpret_cast<Floats::Part>(mask.part[k]))
               : __builtin_ia32_movmskpd(reinterpret_cast<Doubles::Part>(mask.part[k])));
#else
    for (std::size_t n = 0; n < kPartLanes; ++n) part |= static_cast<std::uint32_t>(mask.part[k][n] & 1) << n;
#endif
    bits |= part << (k * kPartLanes);
  }
  return bits;
}
template <class T>
inline bool any(const Vector<T>& mask) {
  return lane_bits(mask) != 0;
}

inline Doubles sqrt(const Doubles& a) {
  return Doubles::each(
      [](auto x) {
        decltype(x) root;
        for (std::size_t k = 0; k < kBytes / sizeof(double); ++k) root[k] = __builtin_sqrt(x[k]);
        return root;
      },
      a);
}
// Halves are brought together, then quarters and numbers.
inline double sum_of(const Doubles& a) {
  typedef double Two __attribute__((vector_size(16)));
  Two q[4];
  __builtin_memcpy(q, a.part, sizeof q);
  const Two two = (q[0] + q[2]) + (q[1] + q[3]);
  return two[0] + two[1];
}

}  // namespace
}  // namespace radiosity
