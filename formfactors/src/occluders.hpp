// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "patch_groups.hpp"

namespace radiosity {

/// The opaque polygons of a scene as they were before they were cut into patches: in architecture they are few, whatever
/// the number of patches. Answers exactly which part of one convex polygon another one sees.
/// Coordinates are relative to `origin`.
class Occluders {
 public:
  /// Above these, rays are cheaper: polygons in the scene, for pairs of patches; polygons that cast shadows between a pair (each may
  /// cut what the others leave visible in several pieces).
  static constexpr std::size_t kMost = 2048;
  static constexpr std::size_t kMostShadows = 16;
  static constexpr std::size_t kHiders = 512;

  /// For pairs of one of `rows`, or of any patch where there are none, and any patch. The groups are kept by reference. Of more than
  /// kMost polygons the kHiders largest are asked what they hide from the rows.
  Occluders(const PatchMesh& mesh, const std::vector<Facet>& facets, const std::vector<PatchGroup>& groups,
            std::span<const Index> rows, const Vec3& origin);

  /// For points and patches that look at lamps, which are known by their place in the list; facet_of: of each patch.
  Occluders(const PatchMesh& mesh, const std::vector<Facet>& facets, std::span<const Index> facet_of,
            std::span<const Index> lamps, const Vec3& origin);

  /// Whether the scene has few enough polygons for exact visibility to pay.
  bool usable() const { return usable_; }
  /// All of the scene's polygons are there, so that what none of them hides is free.
  bool complete() const { return complete_; }

  /// Bits of the polygons, as many words for each patch or group.
  struct Sides {
    std::vector<std::uint64_t> front;   ///< the polygon has all of it on its front side
    std::vector<std::uint64_t> back;    ///< … on its back side
    std::vector<std::uint64_t> facing;  ///< something of the polygon is in front of it
    std::vector<std::uint64_t>
        left;  ///< of patches: where lines of sight leave by it what they have entered by another polygon
  };

  /// Memory for one thread's questions.
  struct Scratch {
    std::vector<int> near;        ///< what may stand between a patch and some patch of a group
    std::vector<int> candidates;  ///< what may stand between the two patches of a pair
    struct Plane {
      Vec3 normal;
      double offset;
    };
    std::vector<Plane> shaft, shadow;
    std::vector<std::vector<Vec3>> pieces, next;
    std::vector<Vec3> inside, outside, cuts, part;
    Sides sides;  ///< of the patch of look_from
  };

  enum class View { free, hidden, partial, crowded };

  /// Whether patch i of the rows (with these corners) sees all, nothing or part of a whole group of patches: free, hidden, or partial,
  /// and then what may stand between is left in scratch.near.
  View approach(Index i, std::span<const Vec3> p, std::size_t group, Scratch& scratch) const;

  /// Proves that nothing of scratch.near stands between p (part of patch i) and q (part of patch j), or that one polygon
  /// hides them from each other; where neither can be proved, leaves the polygons concerned in scratch.candidates.
  /// Crowded: so many polygons may stand between them that rays are cheaper. p and q are convex. One of i and j is of the rows. Of what
  /// i sees only the backs of, behind fronts, nothing is left.
  View classify(Index i, std::span<const Vec3> p, Index j, std::span<const Vec3> q, Scratch& scratch) const;

  /// Polygons whose shadows from a point of patch i do not overlap: pieces of a facet, or those sides of a solid that the patch is
  /// outside of of which the point sees the fronts; they hide all that the solid hides.
  struct ShadowGroup {
    std::size_t number;
    bool fronts_only;
  };
  ShadowGroup shadow_group(Index i, int polygon) const;
  /// Of scratch.candidates.
  std::span<const Vec3> corners(int polygon) const {
    return polygons_[static_cast<std::size_t>(polygon)].corners;
  }
  const Vec3& normal(int polygon) const { return polygons_[static_cast<std::size_t>(polygon)].normal; }
  /// Leaves of a polygon what is in the shaft of `classify`.
  static void clip_to_shaft(std::vector<Vec3>& polygon, Scratch& scratch);

  /// Leaves in scratch.near what may stand between a point x with normal n and any patch: what has x on one side and reaches
  /// above its horizon.
  void look_from(const Vec3& x, const Vec3& n, Scratch& scratch) const;

  /// As classify, between x and q, part of a lamp, of these polygons: scratch.near, or what may stand between them from anywhere
  /// on a patch on which x lies.
  View classify(const Vec3& x, std::span<const int> polygons, std::size_t lamp, std::span<const Vec3> q,
                Scratch& scratch) const;

  /// Leaves in scratch.sides where the polygons are from all points of a patch of a facet.
  void look_from(std::span<const Vec3> p, const Vec3& n, std::size_t facet, const std::vector<Facet>& facets,
                 Scratch& scratch) const;

  /// As classify, between all of the p of look_from and q, part of a lamp; crowded, too, leaves its polygons in scratch.candidates.
  View classify(std::span<const Vec3> p, std::size_t lamp, std::span<const Vec3> q, Scratch& scratch) const;

  /// Factor from a point x with normal n to the part of q that scratch.candidates leave visible; `all` is the factor to
  /// all of q.
  double visible_point_factor(const Vec3& x, const Vec3& n, std::span<const Vec3> q, double all,
                              Scratch& scratch) const;

 private:
  using Box = Eigen::AlignedBox3d;
  struct Convex {
    std::vector<Vec3> corners;
    Vec3 normal;
    double offset;
    Box box;
    std::size_t facet;
    std::vector<Vec3> inward = {};  ///< of edges: perpendicular to them in the plane
    /// Of polygons with many corners: those by angle about the middle, so that a search finds the edges a point is near to.
    std::vector<double> angles = {};  ///< relative to the first corner's, ascending
    Vec3 middle = Vec3::Zero(), u = Vec3::Zero(), v = Vec3::Zero();
    double inner_radius = 0;  ///< of a circle about the middle within it
    std::vector<double> directions =
        {};                        ///< angles of the edges, likewise; empty where they do not all turn left
    double first_direction = 0;    ///< of the first edge, relative to u
    std::size_t solid = kNoSolid;  ///< of a closed convex surface, all of whose polygons face outwards
  };
  static constexpr std::size_t kNoSolid = std::numeric_limits<std::size_t>::max();
  /// Edges `first`, first + 1, …, modulo the number of corners.
  struct Edges {
    std::size_t first, count;
  };
  static void sort_by_angle(Convex& polygon);
  /// In the polygon's plane, from u towards v.
  static double angle_of(const Convex& polygon, const Vec3& direction);
  /// The least n·x of its corners.
  static double lowest(const Convex& polygon, const Vec3& n);
  /// The only edges of the polygon that can border on the hull of points in its plane, among others.
  static Edges edges_near(const Convex& polygon, std::span<const Vec3> points);
  // Takes the polygons of the facets; false where they are more than `most`, or masks for so many patches would take too much memory.
  bool take(const std::vector<Facet>& facets, const Vec3& origin, std::size_t patches, std::size_t most);
  void clear(Sides& sides, std::size_t count) const;
  // The bit of polygon o in row i of one of the Sides.
  bool bit(const std::vector<std::uint64_t>& mask, std::size_t i, std::size_t o) const {
    return (mask[i * words_ + o / 64] >> (o % 64) & 1) != 0;
  }
  void find_solids();
  void mark_left(std::size_t row, const std::vector<Facet>& facets);

  // `facet` is that of the marked one, `other_side` the facet that is its back: neither ever hides anything from it.
  void mark(Sides& sides, std::size_t i, std::span<const Vec3> corners, const Vec3& normal, double offset,
            std::size_t facet, std::size_t other_side) const;
  // The same of a patch.
  void mark(Sides& sides, std::size_t i, const PatchMesh& mesh, Index patch, const Vec3& origin,
            std::size_t facet, std::size_t other_side) const;
  // What has not both p and q (i of a, j of b) on one side, lies behind neither, and reaches into their box; false where one of it
  // hides them from each other. The largest are asked first.
  bool between(const Sides& a, std::size_t i, std::span<const Vec3> p, const Sides& b, std::size_t j,
               std::span<const Vec3> q, std::vector<int>& result) const;
  // Keeps of scratch.candidates what reaches into the shaft between p and q.
  View narrow(std::span<const Vec3> p, std::span<const Vec3> q, Scratch& scratch) const;
  void make_shaft(std::span<const Vec3> p, std::span<const Vec3> q, Scratch& scratch) const;
  bool in_shaft(const Convex& polygon, const Scratch& scratch) const;
  bool hides(const Convex& polygon, std::span<const Vec3> p, std::span<const Vec3> q) const;
  // Whether some of these polygons hide p and q from each other together: those of one convex solid, or pieces of one facet.
  bool hide_together(std::span<const int> polygons, std::span<const Vec3> p, std::span<const Vec3> q) const;
  bool solid_hides(const std::vector<std::size_t>& solid, std::span<const Vec3> p,
                   std::span<const Vec3> q) const;
  bool facet_hides(std::span<const int> pieces, std::span<const Vec3> p, std::span<const Vec3> q) const;
  bool look_through(const Convex& polygon, const Vec3& x, std::span<const Vec3> q,
                    std::vector<Vec3>& cuts) const;
  struct Round {
    int polygon = -1;    ///< none
    Edges edges{0, 0};   ///< its only ones that can border on what is seen of q through it
    bool hides = false;  ///< one of them hides all of q
  };
  Round find_round(const Vec3& x, std::span<const Vec3> q, Scratch& scratch) const;
  static double hidden_point_factor(const Convex& polygon, Edges edges, const Vec3& x, const Vec3& n,
                                    std::span<const Vec3> q, Scratch& scratch);

  double slack_;
  bool usable_ = false, complete_ = true;
  std::vector<Convex> polygons_;                  // the largest first
  std::vector<std::vector<std::size_t>> solids_;  // their polygons
  std::size_t words_ = 0;
  std::span<const PatchGroup> groups_;
  std::vector<Index> row_;  // per patch: its place in patch_sides_, or −1
  Sides patch_sides_, group_sides_;
};

/// Point to polygon [Lambert1760]: F = 1/(2π) Σ_k n·Γ_k, Γ_k = angle(v_k, v_{k+1}) · (v_k × v_{k+1}) / |v_k × v_{k+1}|,
/// positive when q is counter-clockwise about a normal that points towards x. q lies in front of x's horizon.
double point_factor(const Vec3& x, const Vec3& n, std::span<const Vec3> q);

}  // namespace radiosity
