// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

/// Exact form factors of simple pairs [Howell]; names C-n and B-n are those of the catalogue. Lengths in any
/// unit. In double precision the differences of large terms cost digits when a gap is small: relative error
/// 1e-16·(size/gap)².
namespace radiosity::test {

/// C-11: equal opposed rectangles a × b at distance c.
double opposed_rectangles(double a, double b, double c);

/// C-14: from l × w to l × h, at a right angle along the common edge l.
double perpendicular_rectangles(double l, double w, double h);

/// C-41: from a disk of radius r1 to a coaxial one of radius r2 at distance h.
double coaxial_disks(double r1, double r2, double h);

/// B-3: from a surface element to a parallel rectangle a × b at distance c whose corner lies on the element's
/// normal.
double element_under_corner(double a, double b, double c);

/// The same with the normal through the middle of the rectangle: four corners.
double element_under_centre(double a, double b, double c);

/// Inside a sphere of radius r, from anywhere to a piece of it: A_j / (4πr²).
double inside_sphere(double area, double r);

/// Curved side of a cylinder of radius r and height h, from the inside, to itself.
double cylinder_side_to_itself(double r, double h);

}  // namespace radiosity::test
