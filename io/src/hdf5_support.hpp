// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <H5Cpp.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <type_traits>
#include <vector>

#include "mesh_file.hpp"
#include "radiosity/io/output.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {

template <class T>
const H5::PredType& type_of() {
  if constexpr (std::is_same_v<T, double>) return H5::PredType::NATIVE_DOUBLE;
  if constexpr (std::is_same_v<T, float>) return H5::PredType::NATIVE_FLOAT;
  if constexpr (std::is_same_v<T, std::int32_t>) return H5::PredType::NATIVE_INT32;
  if constexpr (std::is_same_v<T, std::uint64_t> || std::is_same_v<T, std::size_t>)
    return H5::PredType::NATIVE_UINT64;
}

template <class T>
void write_array(H5::H5File& out, const char* name, const std::vector<T>& values,
                 std::vector<hsize_t> shape = {}) {
  if (shape.empty()) shape = {values.size()};
  const H5::DataSpace space(static_cast<int>(shape.size()), shape.data());
  // Offsets are signed in the file, as scipy wants them.
  const H5::PredType& stored = std::is_same_v<T, std::size_t> ? H5::PredType::NATIVE_INT64 : type_of<T>();
  out.createDataSet(name, stored, space).write(values.data(), type_of<T>());
}

template <class T>
std::vector<T> read_array(const H5::H5File& in, const char* name) {
  const H5::DataSet data = in.openDataSet(name);
  std::vector<T> values(static_cast<std::size_t>(data.getSpace().getSimpleExtentNpoints()));
  data.read(values.data(), type_of<T>());
  return values;
}

/// Attributes of the file.
class Attributes {
 public:
  explicit Attributes(H5::H5File& file) : file_(file) {}

  void write(const char* name, const std::string& text) {
    const H5::StrType type(H5::PredType::C_S1, std::max<std::size_t>(1, text.size()));
    file_.createAttribute(name, type, H5::DataSpace(H5S_SCALAR)).write(type, text);
  }
  template <class T>
  void write_number(const char* name, T value) {
    file_.createAttribute(name, type_of<T>(), H5::DataSpace(H5S_SCALAR)).write(type_of<T>(), &value);
  }

  std::string text(const char* name) const {
    const H5::Attribute attribute = file_.openAttribute(name);
    std::string value;
    attribute.read(attribute.getStrType(), value);
    value.resize(std::min(value.size(), value.find('\0')));
    return value;
  }
  template <class T>
  T number(const char* name) const {
    T value{};
    file_.openAttribute(name).read(type_of<T>(), &value);
    return value;
  }

 private:
  H5::H5File& file_;
};

/// Lets `write` fill a file that says which format it is, under its name only when complete. What HDF5 throws becomes an IoError.
template <class Write>
void write_hdf5(const std::filesystem::path& file, const std::string& format, Write&& write) {
  write_atomically(file, [&](const std::filesystem::path& temporary) {
    H5::Exception::dontPrint();
    try {
      H5::H5File out(temporary.string(), H5F_ACC_TRUNC);
      Attributes attributes(out);
      attributes.write("format", format);
      write(out, attributes);
    } catch (const H5::Exception& error) {
      throw IoError("HDF5: " + error.getDetailMsg());
    }
  });
}

/// Opens a file of this format, which holds `what`, and gives what `read` makes of it. What HDF5 throws becomes an IoError that names
/// the file.
template <class Read>
auto read_hdf5(const std::filesystem::path& file, const std::string& format, const std::string& what,
               Read&& read) {
  require_readable(file);
  H5::Exception::dontPrint();
  const auto fail = [&](const std::string& why) {
    return IoError(fmt::format("{}: does not hold {}: {}", file.string(), what, why));
  };
  try {
    H5::H5File in(file.string(), H5F_ACC_RDONLY);
    const Attributes attributes(in);
    if (const std::string found = attributes.text("format"); found != format)
      throw fail(fmt::format("its format is '{}', not '{}'", found, format));
    return read(in, attributes);
  } catch (const H5::Exception& error) {
    throw fail("HDF5: " + error.getDetailMsg());
  }
}

}  // namespace radiosity
