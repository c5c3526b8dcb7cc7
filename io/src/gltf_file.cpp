// SPDX-License-Identifier: GPL-3.0-or-later
#include "gltf_file.hpp"

#include <fmt/format.h>
#include <vtkBase64Utilities.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

using Json = nlohmann::json;

const Json& empty_object() {
  static const Json object = Json::object();
  return object;
}

/// The first `size` bytes of a file, or what there is.
std::string read_bytes(const std::filesystem::path& file, std::size_t size) {
  require_readable(file);
  std::error_code error;
  const auto available = std::filesystem::file_size(file, error);
  if (error) throw IoError(fmt::format("{}: cannot be read: {}", file.string(), error.message()));
  std::string bytes(std::min<std::uintmax_t>(size, available), '\0');
  std::ifstream stream(file, std::ios::binary);
  if (!stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    throw IoError(fmt::format("{}: cannot be read", file.string()));
  return bytes;
}

std::string percent_decoded(std::string_view uri) {
  std::string text;
  for (std::size_t k = 0; k < uri.size(); ++k) {
    unsigned char code = 0;
    const char* const digits = uri.data() + k + 1;
    if (uri[k] == '%' && k + 2 < uri.size() &&
        std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
      text += static_cast<char>(code);
      k += 2;
    } else {
      text += uri[k];
    }
  }
  return text;
}

template <class Stored>
Stored stored(const char* at) {
  Stored value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

/// A whole number, or the fraction of its type's largest that it stands for.
template <class Stored>
double stored(const char* at, bool fraction) {
  const double value = stored<Stored>(at);
  return fraction ? std::max(value / std::numeric_limits<Stored>::max(), -1.0) : value;
}

}  // namespace

GltfItem::GltfItem(const Json& json, std::string place, std::string_view separator)
    : json_(&json), place_(std::move(place)), separator_(separator) {
  if (!json.is_object()) fail(fmt::format("is not an object but of type {}", json.type_name()));
}

void GltfItem::fail(std::string_view rule) const {
  throw InputError(fmt::format("{}: {}", place_, rule));
}

const Json& GltfItem::at(const char* key) const {
  if (!has(key)) fail(fmt::format("'{}' is missing", key));
  return (*json_)[key];
}

std::size_t GltfItem::whole(const char* key) const {
  const Json& value = at(key);
  if (value.is_number_unsigned()) return value.get<std::size_t>();
  fail(fmt::format("'{}' is {}, not a whole number from 0", key,
                   value.is_number() ? value.dump() : value.type_name()));
}

double GltfItem::number(const char* key, double otherwise) const {
  if (!has(key)) return otherwise;
  const Json& value = at(key);
  if (!value.is_number()) fail(fmt::format("'{}' is not a number but of type {}", key, value.type_name()));
  return value.get<double>();
}

bool GltfItem::flag(const char* key) const {
  if (!has(key)) return false;
  const Json& value = at(key);
  if (!value.is_boolean()) fail(fmt::format("'{}' is neither true nor false", key));
  return value.get<bool>();
}

std::string GltfItem::text(const char* key, const std::string& otherwise) const {
  if (!has(key)) return otherwise;
  const Json& value = at(key);
  if (!value.is_string()) fail(fmt::format("'{}' is not a text but of type {}", key, value.type_name()));
  return value.get<std::string>();
}

const Json* GltfItem::array(const char* key) const {
  if (!has(key)) return nullptr;
  const Json& value = at(key);
  if (!value.is_array()) fail(fmt::format("'{}' is not an array but of type {}", key, value.type_name()));
  return &value;
}

std::vector<double> GltfItem::numbers(const char* key, std::size_t count) const {
  std::vector<double> values;
  if (const Json* const all = array(key))
    for (const Json& value : *all) {
      if (!value.is_number()) fail(fmt::format("'{}' holds something of type {}", key, value.type_name()));
      values.push_back(value.get<double>());
    }
  if (count != 0 && values.size() != count)
    fail(fmt::format("'{}' has {} numbers, not {}", key, values.size(), count));
  return values;
}

std::vector<double> GltfItem::numbers(const char* key, std::initializer_list<double> otherwise) const {
  return has(key) ? numbers(key, otherwise.size()) : std::vector<double>(otherwise);
}

std::vector<std::size_t> GltfItem::wholes(const char* key) const {
  std::vector<std::size_t> values;
  if (const Json* const all = array(key))
    for (const Json& value : *all) {
      if (!value.is_number_unsigned()) fail(fmt::format("'{}' holds what is no whole number from 0", key));
      values.push_back(value.get<std::size_t>());
    }
  return values;
}

std::vector<std::string> GltfItem::texts(const char* key) const {
  std::vector<std::string> values;
  if (const Json* const all = array(key))
    for (const Json& value : *all) {
      if (!value.is_string()) fail(fmt::format("'{}' holds something of type {}", key, value.type_name()));
      values.push_back(value.get<std::string>());
    }
  return values;
}

GltfItem GltfItem::object(const char* key) const {
  return {has(key) ? at(key) : empty_object(), place_ + separator_ + key};
}

std::size_t GltfItem::size(const char* key) const {
  const Json* const all = array(key);
  return all ? all->size() : 0;
}

GltfItem GltfItem::element(const char* key, std::size_t index) const {
  if (index >= size(key)) fail(fmt::format("there is no {}[{}]: there are {}", key, index, size(key)));
  return {at(key)[index], fmt::format("{}{}{}[{}]", place_, separator_, key, index)};
}

/// Where the numbers of an accessor lie in its buffer view.
struct GltfFile::Layout {
  std::size_t type;        ///< glTF's componentType
  std::size_t components;  ///< of each element
  bool fraction;           ///< whole numbers stand for fractions

  std::size_t component_size(const GltfItem& source) const {
    switch (type) {
      case 5120:
      case 5121:
        return 1;
      case 5122:
      case 5123:
        return 2;
      case 5125:
      case 5126:
        return 4;
      default:
        source.fail(fmt::format("its componentType {} is none of glTF's", type));
    }
  }

  double value(const char* at) const {
    switch (type) {
      case 5120:
        return stored<std::int8_t>(at, fraction);
      case 5121:
        return stored<std::uint8_t>(at, fraction);
      case 5122:
        return stored<std::int16_t>(at, fraction);
      case 5123:
        return stored<std::uint16_t>(at, fraction);
      case 5125:
        return stored<std::uint32_t>(at, fraction);
      default:
        return stored<float>(at);
    }
  }
};

GltfFile::GltfFile(std::filesystem::path file) : file_(std::move(file)) {
  std::string text;
  split(read_bytes(file_, std::string::npos), text);
  try {
    json_ = Json::parse(text);
  } catch (const Json::exception& error) {
    throw IoError(fmt::format("{}: cannot be understood as glTF: {}", file_.string(), error.what()));
  }
  if (!json_.is_object() || !json_.contains("asset"))
    throw IoError(fmt::format("{}: is not glTF: 'asset' is missing", file_.string()));
  if (const std::string version = root().object("asset").text("version", ""); !version.starts_with("2."))
    throw IoError(fmt::format("{}: is glTF of version '{}'; version 2 is read", file_.string(), version));
  buffers_.resize(root().size("buffers"));
}

/// A .glb is a header, a chunk of JSON and at most one of bytes, each behind its length and type.
void GltfFile::split(const std::string& bytes, std::string& text) {
  if (!bytes.starts_with("glTF")) {
    text = bytes;
    return;
  }
  const auto cut_off = [&](std::uint64_t claimed) {
    throw IoError(
        fmt::format("{}: is cut off: it has {} bytes of {}", file_.string(), bytes.size(), claimed));
  };
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  if (bytes.size() < kHeader) cut_off(kHeader);
  if (const auto version = stored<std::uint32_t>(bytes.data() + 4); version != 2)
    throw IoError(fmt::format("{}: is a .glb of version {}; version 2 is read", file_.string(), version));
  const std::size_t length = stored<std::uint32_t>(bytes.data() + 8);
  if (length > bytes.size()) cut_off(length);
  std::size_t at = kHeader;
  for (const bool first : {true, false}) {
    if (at + kChunkHeader > length) break;
    const std::size_t size = stored<std::uint32_t>(bytes.data() + at);
    const std::string_view type(bytes.data() + at + 4, 4);
    at += kChunkHeader;
    if (size > length - at) cut_off(at + size);
    if (first && type == "JSON")
      text = bytes.substr(at, size);
    else if (!first && type == std::string_view("BIN\0", 4))
      binary_ = bytes.substr(at, size);
    at += size;
  }
  if (text.empty()) throw IoError(fmt::format("{}: its first chunk is not JSON", file_.string()));
}

std::optional<std::string> GltfFile::embedded(std::string_view uri) {
  if (!uri.starts_with("data:")) return {};
  constexpr std::string_view kBase64 = ";base64,";
  const std::size_t head = uri.find(kBase64);
  if (head == std::string_view::npos) {
    const std::size_t comma = uri.find(',');
    return comma == std::string_view::npos ? std::string() : percent_decoded(uri.substr(comma + 1));
  }
  const std::string_view code = uri.substr(head + kBase64.size());
  std::string bytes(code.size(), '\0');
  if (!code.empty())
    bytes.resize(vtkBase64Utilities::DecodeSafely(reinterpret_cast<const unsigned char*>(code.data()),
                                                  code.size(), reinterpret_cast<unsigned char*>(bytes.data()),
                                                  bytes.size()));
  return bytes;
}

std::filesystem::path GltfFile::neighbour(std::string_view uri) const {
  return file_.parent_path() / percent_decoded(uri);
}

std::string_view GltfFile::buffer(std::size_t number) {
  const GltfItem item = root().element("buffers", number);
  const std::size_t length = item.whole("byteLength");
  std::optional<std::string>& bytes = buffers_[number];
  if (!bytes) {
    if (item.has("uri")) {
      const std::string uri = item.text("uri", "");
      bytes = embedded(uri);
      if (!bytes) bytes = read_bytes(neighbour(uri), length);
    } else if (number == 0 && binary_) {
      bytes = std::move(binary_);
    } else {
      item.fail("'uri' is missing");
    }
    if (bytes->size() < length)
      item.fail(fmt::format("its byteLength is {}, but there are {} bytes", length, bytes->size()));
    bytes_ += length;
  }
  return std::string_view(*bytes).substr(0, length);
}

std::string_view GltfFile::view(std::size_t buffer_view) {
  const GltfItem item = root().element("bufferViews", buffer_view);
  for (const char* const compressed : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
    if (item.object("extensions").has(compressed)) item.fail(fmt::format("{} is not read", compressed));
  const std::size_t offset = item.whole("byteOffset", 0), length = item.whole("byteLength");
  const std::string_view bytes = buffer(item.whole("buffer"));
  if (offset > bytes.size() || length > bytes.size() - offset)
    item.fail(fmt::format("its {} bytes from byte {} on are not within the {} of its buffer", length, offset,
                          bytes.size()));
  return bytes.substr(offset, length);
}

/// Appends `count` elements from the buffer view that `source` names.
void GltfFile::decode(const GltfItem& source, const Layout& layout, std::size_t count,
                      std::vector<double>& values) {
  const std::size_t number = source.whole("bufferView"), offset = source.whole("byteOffset", 0);
  const std::string_view bytes = view(number);
  const std::size_t component = layout.component_size(source), element = component * layout.components;
  const std::size_t stride = root().element("bufferViews", number).whole("byteStride", element);
  if (stride < element)
    source.fail(fmt::format("its elements have {} bytes, the byteStride is {}", element, stride));
  if (count == 0) return;
  if (offset > bytes.size() || element > bytes.size() - offset ||
      count - 1 > (bytes.size() - offset - element) / stride)
    source.fail(
        fmt::format("its {} elements of {} bytes, {} apart, from byte {} on, are not within the {} bytes of "
                    "bufferViews[{}]",
                    count, element, stride, offset, bytes.size(), number));
  for (std::size_t e = 0; e < count; ++e)
    for (std::size_t c = 0; c < layout.components; ++c)
      values.push_back(layout.value(bytes.data() + offset + e * stride + c * component));
}

/// Puts an accessor's sparse values over the others.
void GltfFile::replace(const GltfItem& sparse, Layout layout, std::size_t count,
                       std::vector<double>& values) {
  const std::size_t replaced = sparse.whole("count");
  const GltfItem where = sparse.object("indices");
  std::vector<double> places, others;
  decode(where, {where.whole("componentType"), 1, false}, replaced, places);
  decode(sparse.object("values"), layout, replaced, others);
  for (std::size_t k = 0; k < replaced; ++k) {
    if (!(places[k] >= 0 && places[k] < static_cast<double>(count)))
      where.fail(fmt::format("index {} is not one of the {} elements", places[k], count));
    std::copy_n(others.begin() + static_cast<std::ptrdiff_t>(k * layout.components), layout.components,
                values.begin() +
                    static_cast<std::ptrdiff_t>(static_cast<std::size_t>(places[k]) * layout.components));
  }
}

std::vector<double> GltfFile::numbers(std::size_t accessor, std::size_t components) {
  const GltfItem item = root().element("accessors", accessor);
  const std::string type = item.text("type", "");
  const std::string wanted = components == 1    ? "SCALAR"
                             : components == 16 ? "MAT4"
                                                : fmt::format("VEC{}", components);
  if (type != wanted) item.fail(fmt::format("its type is '{}', where {} is needed", type, wanted));
  const std::size_t count = item.whole("count");
  const Layout layout{item.whole("componentType"), components, item.flag("normalized")};
  std::vector<double> values;
  if (item.has("bufferView")) {
    decode(item, layout, count, values);
  } else {
    // Zeros, some of which sparse values replace. More of them than there are bytes serve no purpose.
    const GltfItem sparse = item.object("sparse");
    if (!item.has("sparse")) item.fail("has neither a bufferView nor sparse values");
    decode(sparse.object("values"), layout, sparse.whole("count"), values);
    if (count > bytes_)
      item.fail(fmt::format("its count {} is above the {} bytes of the buffers", count, bytes_));
    values.assign(count * components, 0.0);
  }
  if (item.has("sparse")) replace(item.object("sparse"), layout, count, values);
  return values;
}

}  // namespace radiosity
