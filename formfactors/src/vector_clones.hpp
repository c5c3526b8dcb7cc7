// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

/// A function whose loops are compiled for several processors, of which the one at hand is chosen when the program starts. (Such a
/// choice is made before the thread sanitizer is ready.) What it calls must be RADIOSITY_INLINE, or it is compiled for the default alone.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define RADIOSITY_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define RADIOSITY_CLONES
#endif
#define RADIOSITY_INLINE inline __attribute__((always_inline))
