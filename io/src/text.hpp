// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "radiosity/meshing/types.hpp"

namespace radiosity {

/// All bytes of a file. Throws IoError.
std::string read_bytes(const std::filesystem::path& file);

/// The lines of a text, with their numbers from 1. Lines end with LF, CR LF or CR; a byte order mark is
/// dropped. A file in UTF-16 is an IoError.
class TextLines {
 public:
  enum class Continuation { none, backslash };

  /// With `backslash`, a line that ends with \ goes on in the next one; the number is that of its first part.
  TextLines(std::filesystem::path file, std::string bytes, Continuation continuation = Continuation::none);

  /// Goes to the next line; false at the end of the text.
  bool next();
  /// Goes to the next line that holds a word; what follows a word that begins with # is a comment.
  bool next_words();

  std::string_view text() const { return text_; }
  const std::vector<std::string_view>& words() const { return words_; }
  Index number() const { return number_; }
  /// "FILE:LINE" of the present line.
  std::string here() const;
  /// Number of the byte after the present line.
  std::size_t end() const { return end_; }
  const std::string& bytes() const { return bytes_; }
  const std::filesystem::path& file() const { return file_; }

 private:
  std::string_view physical_line();

  std::filesystem::path file_;
  std::string bytes_;
  Continuation continuation_;
  std::size_t end_ = 0;
  Index number_ = 0, following_ = 1;
  std::string joined_;
  std::string_view text_;
  std::vector<std::string_view> words_;
};

std::string_view trimmed(std::string_view text);

/// What follows the first word of a line, trimmed.
std::string_view after_first_word(std::string_view line);

/// A piece of a file as a message shows it: trimmed, its first 60 characters, ? for what is no printable ASCII.
std::string shown(std::string_view text);

/// ASCII letters in lower case.
std::string lower_case(std::string_view text);

/// The number that the whole word is, correctly rounded. Absent when it is no number or not finite.
std::optional<double> finite_number(std::string_view word);

/// The whole number that the whole word is. Absent when it is none or exceeds 64 bits.
std::optional<std::int64_t> whole_number(std::string_view word);

/// Three coordinates from word `first` on. Throws InputError that calls them `object` ("vertex 7").
Vec3 coordinates(const TextLines& lines, std::size_t first, std::string_view object);

}  // namespace radiosity
