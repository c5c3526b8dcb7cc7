// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace radiosity {

/// Throws IoError unless a file of this name could be written: the directory exists and is writable, the name
/// is not that of a directory, and the extension is the one wanted (with its dot; empty: any). Leaves nothing
/// behind. To be called before long work whose result goes there.
void require_writable(const std::filesystem::path& file, const std::string& extension);

/// Lets `write` fill a file of a temporary name beside `file` (same extension), then renames it to `file`. If
/// `write` throws, the temporary file is removed and `file` is as it was. Throws IoError naming `file` when
/// that fails.
void write_atomically(const std::filesystem::path& file,
                      const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same for content that is in memory.
void write_file(const std::filesystem::path& file, std::string_view content);

}  // namespace radiosity
