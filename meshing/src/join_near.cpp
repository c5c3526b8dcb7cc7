// SPDX-License-Identifier: GPL-3.0-or-later
#include "join_near.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace radiosity {
namespace {

constexpr double kNormals = 0.75;    // differences of their components
constexpr double kThickness = 0.25;  // of the size
constexpr double kLittle =
    1.0 / 16;  // of its square: an area whose light matters to nothing as much as its number

class Divider {
 public:
  Divider(std::span<const Joinable> items, double size) : items_(items), size_(size), set_(items.size()) {}

  std::vector<Index> run() {
    std::map<Index, std::vector<Index>> kinds;
    for (std::size_t k = 0; k < items_.size(); ++k) {
      if (items_[k].kind < 0)
        set_[k] = sets_++;
      else
        kinds[items_[k].kind].push_back(static_cast<Index>(k));
    }
    for (auto& [kind, members] : kinds) divide(members);
    std::vector<Index> number(sets_, -1);
    Index count = 0;
    for (Index& set : set_) {
      if (number[set] < 0) number[set] = count++;
      set = number[set];
    }
    return set_;
  }

 private:
  void divide(std::span<Index> members) {
    if (members.size() == 1) return close(members);
    constexpr double kRounding = 1e-6;
    Eigen::AlignedBox3d box, centroids, normals;
    Vec3 mean = Vec3::Zero();
    double area = 0;
    for (const Index k : members) {
      const Joinable& item = items_[k];
      box.extend(item.box);
      centroids.extend(item.centroid);
      normals.extend(item.normal);
      mean += item.area * item.normal;
      area += item.area;
    }
    Eigen::Index axis = 0;
    if (box.sizes().maxCoeff() > (1 + kRounding) * size_) {
      centroids.sizes().maxCoeff(&axis);
      return cut(members, centroids.min()[axis], centroids.max()[axis], size_,
                 [&](const Joinable& item) { return item.centroid[axis]; });
    }
    if (area <= kLittle * size_ * size_) return close(members);
    if (normals.sizes().maxCoeff(&axis) > kNormals)
      return cut(members, normals.min()[axis], normals.max()[axis], kNormals,
                 [&](const Joinable& item) { return item.normal[axis]; });
    mean.normalize();
    const Vec3 origin = centroids.min();  // heights are small numbers
    const auto height = [&](const Joinable& item) { return mean.dot(item.centroid - origin); };
    double low = height(items_[members[0]]), high = low;
    for (const Index k : members) {
      low = std::min(low, height(items_[k]));
      high = std::max(high, height(items_[k]));
    }
    if (high - low <= (1 + kRounding) * kThickness * size_) return close(members);
    cut(members, low, high, kThickness * size_, height);
  }

  // At a whole number of steps, near the middle.
  template <class Value>
  void cut(std::span<Index> members, double low, double high, double step, const Value& value) {
    const double count = std::max(2.0, std::ceil((high - low) / step));
    const double at = low + std::floor(count / 2) / count * (high - low);
    auto middle =
        std::stable_partition(members.begin(), members.end(), [&](Index k) { return value(items_[k]) < at; });
    if (middle == members.begin() || middle == members.end())  // all at one place
      middle = members.begin() + static_cast<std::ptrdiff_t>(members.size() / 2);
    divide({members.begin(), middle});
    divide({middle, members.end()});
  }

  void close(std::span<const Index> members) {
    for (const Index k : members) set_[k] = sets_;
    ++sets_;
  }

  std::span<const Joinable> items_;
  double size_;
  std::vector<Index> set_;
  Index sets_ = 0;
};

}  // namespace

std::vector<Index> join_near(std::span<const Joinable> items, double size) {
  return Divider(items, size).run();
}

}  // namespace radiosity
