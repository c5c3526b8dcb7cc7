// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace radiosity {

/// An object in a glTF file's JSON, and its place, with which messages begin: "room.gltf: accessors[3]".
/// What is missing or of another type throws InputError.
class GltfItem {
 public:
  GltfItem(const nlohmann::json& json, std::string place, std::string_view separator = ".");

  [[noreturn]] void fail(std::string_view rule) const;

  bool has(const char* key) const { return json_->contains(key); }
  std::size_t whole(const char* key) const;
  std::size_t whole(const char* key, std::size_t otherwise) const {
    return has(key) ? whole(key) : otherwise;
  }
  double number(const char* key, double otherwise) const;
  bool flag(const char* key) const;  ///< absent: false
  std::string text(const char* key, const std::string& otherwise) const;
  /// `count` numbers (0: any number of them).
  std::vector<double> numbers(const char* key, std::size_t count) const;
  std::vector<double> numbers(const char* key, std::initializer_list<double> otherwise) const;
  std::vector<std::size_t> wholes(const char* key) const;  ///< absent: none
  std::vector<std::string> texts(const char* key) const;   ///< absent: none

  GltfItem object(const char* key) const;   ///< absent: an empty one
  std::size_t size(const char* key) const;  ///< of an array; absent: 0
  GltfItem element(const char* key, std::size_t index) const;
  /// extensions.NAME; absent: an empty object
  GltfItem extension(const char* name) const { return object("extensions").object(name); }

  std::string key() const { return json_->dump(); }  ///< equal for equal objects

 private:
  const nlohmann::json& at(const char* key) const;
  const nlohmann::json* array(const char* key) const;

  const nlohmann::json* json_;
  std::string place_, separator_;
};

/// A .gltf with its buffers, or a .glb: numbers by accessor.
class GltfFile {
 public:
  /// Throws IoError where it is neither, is cut off or is not glTF 2.
  explicit GltfFile(std::filesystem::path file);

  GltfItem root() const { return {json_, file_.string(), ": "}; }

  /// The numbers of an accessor, `components` for each of its elements, which is also what its type must have.
  /// Stored integers that stand for fractions are fractions.
  std::vector<double> numbers(std::size_t accessor, std::size_t components);

  std::string_view view(std::size_t buffer_view);

  /// The bytes of a data: URI; absent for any other.
  static std::optional<std::string> embedded(std::string_view uri);
  /// The file that a URI relative to this one means, %20 and its like decoded.
  std::filesystem::path neighbour(std::string_view uri) const;

 private:
  struct Layout;  ///< of numbers in a buffer view

  void split(const std::string& bytes, std::string& text);
  std::string_view buffer(std::size_t number);
  void decode(const GltfItem& source, const Layout& layout, std::size_t count, std::vector<double>& values);
  void replace(const GltfItem& sparse, Layout layout, std::size_t count, std::vector<double>& values);

  std::filesystem::path file_;
  nlohmann::json json_;
  std::optional<std::string> binary_;  ///< the second chunk of a .glb
  std::vector<std::optional<std::string>> buffers_;
  std::size_t bytes_ = 0;  ///< of all buffers
};

}  // namespace radiosity
