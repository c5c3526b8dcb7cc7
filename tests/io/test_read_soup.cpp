// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

#include "files.hpp"
#include "radiosity/io/read_scene.hpp"

namespace radiosity::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

/// A box whose fronts look inwards.
const std::vector<Vec3> kBoxVertices{{0, 0, 0},   {4, 0, 0},   {4, 0, 3},   {0, 0, 3},
                                     {0, 2.5, 0}, {4, 2.5, 0}, {4, 2.5, 3}, {0, 2.5, 3}};
const std::vector<std::array<Index, 4>> kBoxFaces{{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                                  {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
const std::string kBoxText =
    "0 0 0\n4 0 0\n4 0 3\n0 0 3\n0 2.5 0\n4 2.5 0\n4 2.5 3\n0 2.5 3\n"
    "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";

void expect_box(const Scene& scene, double scale = 1) {
  ASSERT_EQ(scene.vertex_count(), 8);
  for (std::size_t v = 0; v < 8; ++v) EXPECT_EQ(scene.vertices()[v], scale * kBoxVertices[v]) << v;
  ASSERT_EQ(scene.face_count(), 6);
  for (Index f = 0; f < 6; ++f) EXPECT_TRUE(std::ranges::equal(scene.corners(f), kBoxFaces[f])) << f;
}

class SoupFiles : public testing::Test {
 protected:
  explicit SoupFiles(std::string name) : name_(std::move(name)) {}
  LoadedScene read(const std::string& text) const { return read_scene(directory_.write(name_, text)); }
  template <class Exception>
  std::string error(const std::string& text) const {
    const std::string message = message_of<Exception>([&] { read(text); });
    EXPECT_THAT(message, StartsWith((directory_ / name_).string()));
    return message;
  }
  const TemporaryDirectory directory_;
  const std::string name_;
};

class PlyFiles : public SoupFiles {
 protected:
  PlyFiles() : SoupFiles("a.ply") {}
};

std::string ply_header(const std::string& format, const std::string& coordinate, const std::string& list) {
  return "ply\nformat " + format + " 1.0\nelement vertex 8\nproperty " + coordinate + " x\nproperty " +
         coordinate + " y\nproperty " + coordinate + " z\nelement face 6\nproperty list " + list +
         " vertex_indices\nend_header\n";
}

/// The number as bytes, least significant first or last.
template <class Value>
std::string bytes(double number, bool big) {
  std::string result(sizeof(Value), '\0');
  const auto value = static_cast<Value>(number);
  std::memcpy(result.data(), &value, sizeof value);
  if (big == (std::endian::native == std::endian::little)) std::reverse(result.begin(), result.end());
  return result;
}

struct PlyType {
  std::string name;
  std::string (*encode)(double, bool);
};
const std::vector<PlyType> kPlyTypes{
    {"char", bytes<std::int8_t>},     {"int8", bytes<std::int8_t>},     {"uchar", bytes<std::uint8_t>},
    {"uint8", bytes<std::uint8_t>},   {"short", bytes<std::int16_t>},   {"int16", bytes<std::int16_t>},
    {"ushort", bytes<std::uint16_t>}, {"uint16", bytes<std::uint16_t>}, {"int", bytes<std::int32_t>},
    {"int32", bytes<std::int32_t>},   {"uint", bytes<std::uint32_t>},   {"uint32", bytes<std::uint32_t>},
    {"float", bytes<float>},          {"float32", bytes<float>},        {"double", bytes<double>},
    {"float64", bytes<double>}};

TEST_F(PlyFiles, EveryTypeOfCoordinatesLengthsAndIndicesIsReadInEveryEncoding) {
  for (const std::string format : {"ascii", "binary_little_endian", "binary_big_endian"})
    for (const PlyType& type : kPlyTypes)
      for (const PlyType& index : kPlyTypes) {
        SCOPED_TRACE(format + ' ' + type.name + ' ' + index.name);
        // Twice the size, so that every coordinate is a whole number.
        std::string text = ply_header(format, type.name, index.name + " " + index.name);
        if (format == "ascii") {
          text += replaced(replaced(kBoxText.substr(0, kBoxText.find("4 0 3 2")), "4 ", "8 "), "3\n", "6\n");
          text = replaced(text, "2.5", "5") + kBoxText.substr(kBoxText.find("4 0 3 2"));
        } else {
          const bool big = format == "binary_big_endian";
          for (const Vec3& x : kBoxVertices)
            for (const double coordinate : x) text += type.encode(2 * coordinate, big);
          for (const auto& face : kBoxFaces) {
            text += index.encode(4, big);
            for (const Index v : face) text += index.encode(v, big);
          }
        }
        expect_box(read(text).scene, 2);
      }
}

TEST_F(PlyFiles, OtherElementsAndPropertiesArePassedOver) {
  const std::string text =
      "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nelement material 1\r\nproperty list uchar float "
      "shine\r\n"
      "property int id\r\nelement vertex 3\r\nproperty uchar red\r\nproperty float z\r\nproperty float y\r\n"
      "property float x\r\nelement face 1\r\nproperty list uchar float texcoord\r\n"
      "property list uchar int vertex_index\r\nproperty int flags\r\nelement edge 1\r\nproperty int "
      "vertex1\r\n"
      "property int vertex2\r\nend_header\r\n2 0.5 0.25 7\r\n255 3 2 1\r\n0 6 5 4\r\n0 7 8 0\r\n"
      "2 0.5 0.5 3 2 1 0 9\r\n0 1\r\n";
  const LoadedScene loaded = read(text);
  EXPECT_EQ(loaded.scene.vertices()[0], Vec3(1, 2, 3));
  EXPECT_EQ(loaded.scene.vertices()[1], Vec3(4, 5, 6));
  EXPECT_THAT(loaded.scene.corners(0), ElementsAre(2, 1, 0));
  EXPECT_THAT(loaded.warnings, ElementsAre("1 edges are not surfaces: left out"));
}

TEST_F(PlyFiles, TriangleStripsAreTriangles) {
  // Every other triangle is turned; -1 begins anew; 4 4 names a vertex twice, to join strips.
  const std::string header =
      replaced(ply_header("ascii", "float", "int int"), "element face 6", "element tristrips 1");
  const std::string vertices = kBoxText.substr(0, kBoxText.find("4 0 3 2"));
  const Scene scene = read(header + vertices + "11 0 1 3 2 -1 4 5 6 6 2 3\n").scene;
  const std::vector<std::vector<Index>> expected{{0, 1, 3}, {3, 1, 2}, {4, 5, 6}, {2, 6, 3}};
  ASSERT_EQ(scene.face_count(), 4);
  for (Index f = 0; f < 4; ++f) EXPECT_TRUE(std::ranges::equal(scene.corners(f), expected[f])) << f;
}

TEST_F(PlyFiles, AHeaderThatBreaksARuleIsAnErrorWithItsLine) {
  const std::string good = ply_header("ascii", "float", "uchar int") + kBoxText;
  const auto bad = [&](const std::string& from, const std::string& to) {
    EXPECT_NE(good.find(from), std::string::npos) << from;
    return error<IoError>(replaced(good, from, to));
  };
  EXPECT_THAT(bad("ply\n", "PLY\n"), HasSubstr("does not begin with the line 'ply'"));
  EXPECT_THAT(bad("element vertex 8\n", ""),
              HasSubstr("a.ply:3: a property stands before the first element"));
  EXPECT_THAT(bad("element vertex 8", "ekement vertex 8"), HasSubstr("a.ply:3: 'ekement vertex 8' is not"));
  EXPECT_THAT(bad("vertex 8", "vertex -8"), HasSubstr("a.ply:3: '-8' is not a number of elements"));
  EXPECT_THAT(bad("vertex 8", "vertex 99999999999999999999"), HasSubstr("a.ply:3"));
  EXPECT_THAT(bad("float y", "real y"), HasSubstr("a.ply:5: 'real' is not a type"));
  EXPECT_THAT(bad("float y", "float y y"), HasSubstr("a.ply:5: a property is"));
  EXPECT_THAT(bad("property float y\n", ""), HasSubstr("element 'vertex' has no property 'y'"));
  EXPECT_THAT(bad("vertex_indices", "corners"), HasSubstr("element 'face' has no property"));
  EXPECT_THAT(bad("list uchar int", "int"), HasSubstr("element 'face' has no property"));
  EXPECT_THAT(bad("ascii", "text"), HasSubstr("no line 'format' says ascii"));
  EXPECT_THAT(bad("1.0\n", "2.0\n"), HasSubstr("a.ply:2: 'format ascii 2.0' is not"));
  EXPECT_THAT(bad("end_header\n", ""), HasSubstr("a.ply:9: '0 0 0' is not a line of a ply header"));
  EXPECT_THAT(error<IoError>(good.substr(0, good.find("element face"))),
              HasSubstr("a.ply:6: the header has no line 'end_header'"));
}

TEST_F(PlyFiles, DataThatDoNotFitTheHeaderAreAnErrorWithTheirLine) {
  const std::string good = ply_header("ascii", "float", "uchar int") + kBoxText;
  const auto bad = [&](const std::string& from, const std::string& to) { return replaced(good, from, to); };
  EXPECT_THAT(error<IoError>(bad("face 6", "face 7")), HasSubstr("ends before face 6 (counted from 0)"));
  EXPECT_THAT(error<IoError>(bad("face 6", "face 5")), HasSubstr("a.ply:23: goes on after the last"));
  EXPECT_THAT(error<IoError>(bad("face 6", "face 4000000000000")), HasSubstr("ends before face 6"));
  EXPECT_THAT(error<IoError>(bad("0 2.5 0\n", "0 2.5\n")), HasSubstr("a.ply:14: vertex 4 (counted from 0)"));
  EXPECT_THAT(error<IoError>(bad("0 2.5 0\n", "0 2.5 0 0\n")), HasSubstr("a.ply:14: vertex 4"));
  EXPECT_THAT(error<InputError>(bad("0 2.5 0\n", "0 2,5 0\n")),
              HasSubstr("a.ply:14: vertex 4 (counted from 0): '2,5'"));
  EXPECT_THAT(error<InputError>(bad("0 2.5 0\n", "0 nan 0\n")), HasSubstr("'nan' is not a finite number"));
  EXPECT_THAT(error<IoError>(bad("4 4 5 6 7", "5 4 5 6 7")), HasSubstr("a.ply:19: face 1"));
  EXPECT_THAT(error<IoError>(bad("4 4 5 6 7", "-4 4 5 6 7")), HasSubstr("a.ply:19: face 1"));
  EXPECT_THAT(error<InputError>(bad("4 4 5 6 7", "2 4 5")), HasSubstr("has 2 corners"));
  for (const std::string v : {"-1", "8", "5.5", "4294967296", "1e300"})
    EXPECT_THAT(error<InputError>(bad("4 4 5 6 7", "4 4 " + v + " 6 7")),
                HasSubstr("face 1 (counted from 0) refers to vertex"));
}

TEST_F(PlyFiles, BinaryDataCutAnywhereOrTooLongAreAnError) {
  for (const bool big : {false, true}) {
    std::string text =
        ply_header(big ? "binary_big_endian" : "binary_little_endian", "float", "uchar ushort");
    const std::size_t header = text.size();
    for (const Vec3& x : kBoxVertices)
      for (const double coordinate : x) text += bytes<float>(coordinate, big);
    for (const auto& face : kBoxFaces) {
      text += bytes<std::uint8_t>(4, big);
      for (const Index v : face) text += bytes<std::uint16_t>(v, big);
    }
    expect_box(read(text).scene);
    expect_box(read(replaced(text.substr(0, header), "\n", "\r\n") + text.substr(header)).scene);
    for (std::size_t size = 0; size < text.size(); ++size)
      EXPECT_THROW(read(text.substr(0, size)), IoError) << size;
    EXPECT_THAT(error<IoError>(text + "\1"), HasSubstr("goes on after the last"));
  }
}

class OffFiles : public SoupFiles {
 protected:
  OffFiles() : SoupFiles("a.off") {}
};

TEST_F(OffFiles, EveryFormOfTheHeaderIsRead) {
  for (const std::string header : {"OFF\n8 6 12\n", "OFF\n8 6\n", "OFF 8 6 0\n", "OFF8 6 0\n", "OFF8 6\n",
                                   "# a box\nOFF # text\n\n# counts\n8 6 0 # of edges\n\n", "COFF\n8 6 0\n",
                                   "\xef\xbb\xbfOFF\n8 6 0\n", "STCNOFF\n8 6 0\n"})
    for (const std::string end : {"\n", "\r\n", "\r"})
      expect_box(read(replaced(header + kBoxText, "\n", end)).scene);
}

TEST_F(OffFiles, ColoursNormalsAndTextureCoordinatesArePassedOver) {
  expect_box(read("COFF\n8 6 0\n" + replaced(kBoxText, "0 2.5 0\n", "0 2.5 0 255 0 0 255\n")).scene);
  expect_box(read("NOFF\n8 6 0\n" + replaced(kBoxText, "0 2.5 0\n", "0 2.5 0 0 0 1\n")).scene);
  expect_box(
      read("OFF\n8 6 0\n" + replaced(kBoxText, "4 4 5 6 7\n", "4 4 5 6 7 0.5 0.5 0.5 # grey\n")).scene);
  EXPECT_THAT(error<IoError>("OFF\n8 6 0\n" + replaced(kBoxText, "0 2.5 0\n", "0 2.5 0 1\n")),
              HasSubstr("a.off:7: vertex 4 (counted from 0) has 4 values, but at most 3"));
}

TEST_F(OffFiles, WhatBreaksARuleIsAnErrorWithItsLine) {
  const auto bad = [&](const std::string& from, const std::string& to) {
    return replaced("OFF\n8 6 0\n" + kBoxText, from, to);
  };
  for (const std::string keyword : {"4OFF", "nOFF", "off", "8", "SKEL", "OFFS"})
    EXPECT_THAT(error<IoError>(bad("OFF", keyword)), HasSubstr("a.off:1: does not begin with OFF"))
        << keyword;
  EXPECT_THAT(error<IoError>(bad("OFF", "OFF BINARY")), HasSubstr("a.off:1: binary off files are not read"));
  for (const std::string counts : {"8", "8 6 0 0", "8 six 0", "8 -6 0", "8.0 6 0", "0 0 0\n"})
    EXPECT_THAT(error<Error>(bad("8 6 0\n", counts + "\n")), HasSubstr("a.off:")) << counts;
  EXPECT_THAT(error<IoError>(bad("8 6 0\n", "8 7 0\n")), HasSubstr("ends before face 6 (counted from 0)"));
  EXPECT_THAT(error<IoError>(bad("8 6 0\n", "8 5 0\n")),
              HasSubstr("a.off:16: goes on after the 8 vertices and 5 faces"));
  EXPECT_THAT(error<IoError>(bad("8 6 0\n", "9 6 0\n")), HasSubstr("a.off:11"));
  EXPECT_THAT(error<InputError>(bad("0 2.5 0\n", "0 2.5\n")),
              HasSubstr("a.off:7: vertex 4 (counted from 0) has 2 coordinates"));
  EXPECT_THAT(error<InputError>(bad("0 2.5 0\n", "0 inf 0\n")), HasSubstr("coordinate 'inf'"));
  EXPECT_THAT(error<IoError>(bad("4 4 5 6 7", "5 4 5 6 7")), HasSubstr("a.off:12: face 1"));
  EXPECT_THAT(error<IoError>(bad("4 4 5 6 7", "4.5 4 5 6 7")), HasSubstr("a.off:12: face 1"));
  EXPECT_THAT(error<InputError>(bad("4 4 5 6 7", "2 4 5")),
              HasSubstr("a.off:12: face 1 (counted from 0) has 2 corners"));
  for (const std::string v : {"-1", "8", "5.5", "99999999999999999999", "x"})
    EXPECT_THAT(error<InputError>(bad("4 4 5 6 7", "4 4 " + v + " 6 7")),
                HasSubstr("a.off:12: face 1 (counted from 0) refers to vertex " + v));
}

class StlFiles : public SoupFiles {
 protected:
  StlFiles() : SoupFiles("a.stl") {}
};

const std::string kStl =
    "solid room\n  facet normal 0 0 1\n    outer loop\n      vertex 0 0 0\n      vertex 1 0 0\n"
    "      vertex 1 1.5 0\n    endloop\n  endfacet\n  facet normal 0 0 1\n    outer loop\n      vertex 0 0 "
    "0\n"
    "      vertex 1 1.5 0\n      vertex 0 1.5 0\n    endloop\n  endfacet\nendsolid room\n";

void expect_square(const Scene& scene) {
  ASSERT_EQ(scene.vertex_count(), 4);
  EXPECT_EQ(scene.vertices()[2], Vec3(1, 1.5, 0));
  ASSERT_EQ(scene.face_count(), 2);
  EXPECT_THAT(scene.corners(0), ElementsAre(0, 1, 2));
  EXPECT_THAT(scene.corners(1), ElementsAre(0, 2, 3));
}

TEST_F(StlFiles, TextIsReadWhateverItsBlanksLettersAndName) {
  std::string upper = kStl;
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  for (const std::string& text :
       {kStl, upper, replaced(kStl, "solid room", "solid\troom"), "\xef\xbb\xbf" + kStl, "\n  " + kStl,
        replaced(kStl, "solid room", "Solid solid facet 1"), replaced(kStl, "solid room", "solid"),
        replaced(kStl, "\n", "\r\n"), replaced(kStl, "\n", "\r"), replaced(kStl, " ", " \t"),
        replaced(kStl, "1.5", "+15.0E-1"), replaced(kStl, "0 0 1\n", "-nan(ind) -nan(ind) -nan(ind)\n"),
        replaced(kStl, " 0 0 1\n", "\n"), replaced(kStl, "outer loop\n", "outer loop # of three\n"),
        kStl.substr(0, kStl.size() - 1)})
    expect_square(read(text).scene);
}

TEST_F(StlFiles, SeveralSolidsAreOneScene) {
  const auto second = kStl.find("  facet", kStl.find("endfacet"));
  expect_square(read(kStl.substr(0, second) + "endsolid\nsolid other one\n" + kStl.substr(second)).scene);
}

TEST_F(StlFiles, TextThatBreaksARuleIsAnErrorWithItsLine) {
  const auto bad = [&](const std::string& from, const std::string& to) { return replaced(kStl, from, to); };
  EXPECT_THAT(error<IoError>(bad("vertex 0 1.5 0\n", "")),
              HasSubstr("a.stl:13: expected 'vertex', found 'endloop'"));
  EXPECT_THAT(error<IoError>(bad("vertex 0 1.5 0\n", "vertex 0 1.5 0\nvertex 0 1 0\n")),
              HasSubstr("a.stl:14: expected 'endloop', found 'vertex'"));
  EXPECT_THAT(error<InputError>(bad("vertex 0 1.5 0\n", "vertex 0 1.5\n")), HasSubstr("a.stl:14: facet 1"));
  EXPECT_THAT(error<InputError>(bad("vertex 0 1.5 0\n", "vertex 0 inf 0\n")), HasSubstr("a.stl:13: facet 1"));
  EXPECT_THAT(error<IoError>(bad("endsolid room\n", "solid room\n")),
              HasSubstr("a.stl:16: expected 'facet' or 'endsolid'"));
  // Of text that is cut anywhere before 'endsolid' something is missing.
  for (std::size_t size = 1; size < kStl.rfind("endsolid") + 8; ++size)
    EXPECT_THROW(read(kStl.substr(0, size)), Error) << size;
}

std::string binary_stl(std::string header, std::uint32_t count, std::size_t triangles) {
  header.resize(80, ' ');
  header += bytes<std::uint32_t>(count, false);
  for (std::size_t t = 0; t < triangles; ++t) {
    for (const double x : {0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1}) header += bytes<float>(x, false);
    header += bytes<float>(static_cast<double>(t), false) + "rg";
  }
  return header;
}

TEST_F(StlFiles, BinaryFilesMayBeginWithSolid) {
  for (const std::string header : {"solid made of facets", "SOLID", "", "\n solid facet endsolid"}) {
    const Scene scene = read(binary_stl(header, 2, 2)).scene;
    EXPECT_EQ(scene.face_count(), 2);
    EXPECT_EQ(scene.vertices().back(), Vec3(1, 1, 1));
  }
}

TEST_F(StlFiles, BinaryFilesWhoseCountIsNotThatOfTheirDataAreAnError) {
  for (const std::string header : {"solid", "made by hand"}) {
    EXPECT_THAT(error<IoError>(binary_stl(header, 1, 2)),
                AllOf(HasSubstr("counts 1 triangles"), HasSubstr("134 bytes, but the file has 184"),
                      HasSubstr("more than its header counts")));
    EXPECT_THAT(error<IoError>(binary_stl(header, 3, 2)),
                AllOf(HasSubstr("counts 3 triangles"), HasSubstr("cut off")));
    EXPECT_THAT(error<IoError>(binary_stl(header, 4294967295U, 2)), HasSubstr("cut off"));
    const std::string good = binary_stl(header, 2, 2);
    for (std::size_t size = 0; size < good.size(); ++size)
      EXPECT_THROW(read(good.substr(0, size)), Error) << size;
  }
}

}  // namespace
}  // namespace radiosity::test
