// SPDX-License-Identifier: GPL-3.0-or-later
#include "cases/closed_forms.hpp"

#include <cmath>
#include <numbers>

namespace radiosity::test {

using std::numbers::pi;

double opposed_rectangles(double a, double b, double c) {
  const double x = a / c, y = b / c;
  const double p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
  return 2 / (pi * x * y) *
         (std::log(p * q / std::sqrt(1 + x * x + y * y)) + x * q * std::atan(x / q) +
          y * p * std::atan(y / p) - x * std::atan(x) - y * std::atan(y));
}

double perpendicular_rectangles(double l, double w, double h) {
  const double hh = (h / l) * (h / l), ww = (w / l) * (w / l);
  const double height = h / l, width = w / l, s = std::sqrt(hh + ww);
  const double logs = std::log((1 + ww) * (1 + hh) / (1 + ww + hh)) +
                      ww * std::log(ww * (1 + ww + hh) / ((1 + ww) * (ww + hh))) +
                      hh * std::log(hh * (1 + hh + ww) / ((1 + hh) * (hh + ww)));
  return (width * std::atan(1 / width) + height * std::atan(1 / height) - s * std::atan(1 / s) + logs / 4) /
         (pi * width);
}

double coaxial_disks(double r1, double r2, double h) {
  const double p = r1 / h, q = r2 / h;
  const double x = 1 + (1 + q * q) / (p * p);
  return (x - std::sqrt(x * x - 4 * (q / p) * (q / p))) / 2;
}

double element_under_corner(double a, double b, double c) {
  const double x = a / c, y = b / c;
  const double p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
  return (x / p * std::atan(y / p) + y / q * std::atan(x / q)) / (2 * pi);
}

double element_under_centre(double a, double b, double c) {
  return 4 * element_under_corner(a / 2, b / 2, c);
}

double inside_sphere(double area, double r) {
  return area / (4 * pi * r * r);
}

double cylinder_side_to_itself(double r, double h) {
  const double x = h / (2 * r);
  return 1 + x - std::sqrt(1 + x * x);
}

}  // namespace radiosity::test
