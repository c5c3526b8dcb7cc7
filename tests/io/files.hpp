// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/patch_mesh.hpp"

namespace radiosity::test {

/// A directory of its own, gone at the end.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    static int count = 0;
    path_ = std::filesystem::path(testing::TempDir()) /
            ("radiosity-io-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
    std::filesystem::create_directories(path_);
  }
  ~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }

  std::ptrdiff_t entries() const {
    return std::distance(std::filesystem::directory_iterator(path_), std::filesystem::directory_iterator());
  }

 private:
  std::filesystem::path path_;
};

inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// Every `from` in it is `to`.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

/// What `act` throws says; a failure when it throws nothing or something else. Nothing may be printed.
template <class Exception, class Act>
std::string message_of(Act&& act) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  std::string message = "(nothing was thrown)";
  try {
    act();
    ADD_FAILURE() << message;
  } catch (const Exception& error) {
    message = error.what();
  } catch (const std::exception& error) {
    ADD_FAILURE() << "another exception: " << error.what();
  }
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  return message;
}

inline Material material(std::string name, BandValues reflectance, BandValues emission) {
  return {std::move(name), std::move(reflectance), std::move(emission)};
}

inline BandValues rgb(double r, double g, double b) {
  return Eigen::Array3d(r, g, b);
}

/// One polygon as one patch, material with `bands` bands, ρ = 0.5.
inline PatchMesh one_patch(std::vector<Vec3> loop, Index bands = 3) {
  PatchMesh::Arrays arrays;
  for (std::size_t v = 0; v < loop.size(); ++v) arrays.corners.push_back(static_cast<Index>(v));
  arrays.vertices = std::move(loop);
  arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
  arrays.patch_surface = {0};
  arrays.patch_material = {0};
  arrays.materials = {material("wall", BandValues::Constant(bands, 0.5), BandValues::Zero(bands))};
  return PatchMesh(std::move(arrays));
}

/// Inside of a box: quads whose fronts look inwards; `open` leaves out the wall at the largest z. Walls are
/// numbered −x, +x, −y, +y, −z, +z.
inline PatchMesh room(const Vec3& lower, const Vec3& upper, bool open) {
  PatchMesh::Arrays arrays;
  for (int k = 0; k < 8; ++k)
    arrays.vertices.emplace_back((k & 1) ? upper.x() : lower.x(), (k & 2) ? upper.y() : lower.y(),
                                 (k & 4) ? upper.z() : lower.z());
  const std::vector<std::array<Index, 4>> walls{{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1},
                                                {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};
  for (std::size_t w = 0; w < (open ? 5U : 6U); ++w) {
    arrays.corners.insert(arrays.corners.end(), walls[w].begin(), walls[w].end());
    arrays.patch_start.push_back(static_cast<Index>(arrays.corners.size()));
    arrays.patch_surface.push_back(static_cast<Index>(w));
    arrays.patch_material.push_back(0);
  }
  arrays.materials = {material("wall", BandValues::Constant(1, 0.5), BandValues::Zero(1))};
  return PatchMesh(std::move(arrays));
}

}  // namespace radiosity::test
