// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace radiosity::test {

/// Whether this is the build with the address sanitizer, in which a program takes about ten times as long. Tests that repeat the
/// same lines at growing size, for a figure, repeat them fewer times there.
#ifdef __SANITIZE_ADDRESS__
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace radiosity::test
