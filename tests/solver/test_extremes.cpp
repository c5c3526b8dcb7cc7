// SPDX-License-Identifier: GPL-3.0-or-later
// Every row of docs/limits.md.
#include <gtest/gtest.h>

#include "cases/limits.hpp"

namespace radiosity::test {
namespace {

class Extremes : public testing::TestWithParam<Limit> {};

INSTANTIATE_TEST_SUITE_P(All, Extremes, testing::ValuesIn(limits()),
                         [](const auto& row) { return row.param.name; });

TEST_P(Extremes, HaveTheRightAnswerOrARefusal) {
  const Limit::Outcome outcome = GetParam().run();
  EXPECT_LE(outcome.error, outcome.allowed) << outcome.came_out;
}

}  // namespace

// gtest would print the bytes.
void PrintTo(const Limit& limit, std::ostream* out) {
  *out << limit.asked;
}

}  // namespace radiosity::test
