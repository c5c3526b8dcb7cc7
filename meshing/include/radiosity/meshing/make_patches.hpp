// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "radiosity/meshing/patch_mesh.hpp"
#include "radiosity/meshing/scene.hpp"

namespace radiosity {

struct KeepFaces {};  ///< every face is one patch
struct AutoPatches {  ///< the size that gives about `target` clusters, whatever the number of faces
  Index target = 5000;
};
struct
    PatchSize {  ///< no edge of a patch is longer than this, and smaller faces are joined to clusters no longer either
  double metres;
};
using PatchOptions = std::variant<AutoPatches, KeepFaces, PatchSize>;

/// What was done to the faces before they could be patches. All counts are of vertices or faces of the scene.
struct Repairs {
  Index merged_vertices = 0;   ///< vertices at exactly the same position as another
  Index degenerate_faces = 0;  ///< dropped: no area beyond rounding
  Index duplicate_faces = 0;   ///< dropped: within another face of the same material that faces the same way
  Index unwound_faces = 0;     ///< their corners went round several times; one round is left
  Index flipped_faces = 0;     ///< turned over to agree with the larger area of their connected surface
  Index triangulated_faces = 0;  ///< not a triangle and not a convex planar quad
  Index non_planar_faces = 0;    ///< among those, the ones that leave their mean plane
  Index split_edges = 0;         ///< given the vertices of other faces that lie on them (T-junctions)
  Index cut_faces = 0;           ///< cut along lines where other faces touch or cross them
};

struct Patches {
  PatchMesh mesh;
  Repairs repairs;
  std::vector<std::string> warnings;  ///< sentences for the user, each naming the faces it is about
  double patch_size = 0;              ///< m; 0 where no face had to be divided for its size
};

/// Scene → patches.
/// 1. Repair: equal vertices are merged, degenerate and duplicate faces dropped, faces oriented consistently.
/// 2. Faces are cut along lines where other faces stand on them or pass through them (not with KeepFaces), so
/// that
///    no patch is half covered: a patch cut by a contact line gets single form factors wrong by up to one
///    half.
/// 3. Convex planar quads become regular grids of quads, everything else well-shaped triangles. Neighbouring
///    faces share the points on their common edge, so no cracks open and no T-vertices appear between them.
/// 4. Pieces of faces of less than half the square of the size, and slivers of others (a sixteenth of it), are joined to clusters (not
///    with KeepFaces): those of one material that fit into a cube of the size, face about the same way and do not lie one behind the
///    other, after face clusters [Willmott1999].
/// Patches keep the order of the faces, pieces of one face are consecutive; the back sides of two-sided faces
/// follow at the end, in the same order, with the same surface numbers.
/// With KeepFaces patch i is face i, whatever its shape (unless degenerate faces had to be dropped: then a
/// warning names them). Throws InputError when nothing is left, or when the size is not positive or would
/// give more than 2^31 patches, or one face more than tolerance::kMostPiecesOfFace.
Patches make_patches(const Scene& scene, const PatchOptions& options = AutoPatches{});

}  // namespace radiosity
