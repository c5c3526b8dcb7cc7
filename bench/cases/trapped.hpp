// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tbb/parallel_for.h>

#include <cfenv>

namespace radiosity::test {

/// While it lives, a division by zero or an invalid operation of this thread ends the program: nothing may come from dividing
/// by a reflectance of 0 and be thrown away afterwards.
class FloatingPointTrap {
 public:
  FloatingPointTrap() : before_(fegetexcept()) {
    tbb::parallel_for(0, 2, [](int) {});  // TBB keeps the traps of the moment at which it is first used
    std::feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(FE_DIVBYZERO | FE_INVALID);
  }
  ~FloatingPointTrap() {
    fedisableexcept(FE_ALL_EXCEPT);
    feenableexcept(before_);
  }
  FloatingPointTrap(const FloatingPointTrap&) = delete;
  FloatingPointTrap& operator=(const FloatingPointTrap&) = delete;

 private:
  int before_;
};

}  // namespace radiosity::test
