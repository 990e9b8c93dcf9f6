#include "drivers/files/height_map_file.hpp"

#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace merkel {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

template <class Real>
std::string npy(const std::string& shape, const std::vector<Real>& values,
                const std::string& order = "False") {
  std::string header = "{'descr': '<f" + std::to_string(sizeof(Real)) +
                       "', 'fortran_order': " + order + ", 'shape': " + shape + ", }\n";
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size());
  bytes += '\0';
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Real));
  return bytes;
}

std::string refusal(const Expected<HeightMap, SetupError>& read) {
  return read ? "" : read.error().sentence;
}

TEST(HeightMapFile, ReadsNumPyInBothOrdersAndPrecisions) {
  const std::vector<double> expected{0.0, 1.0, 2.0, 3.0, 4.0, 5.0};
  const auto rows = parse_npy_heights(npy<double>("(2, 3)", {1, 2, 3, 4, 5, 6}), "a", 0.1);
  const auto columns =
      parse_npy_heights(npy<float>("(2, 3)", {1, 4, 2, 5, 3, 6}, "True"), "a", 0.1);
  for (const auto& read : {rows, columns}) {
    ASSERT_TRUE(read) << refusal(read);
    EXPECT_EQ(read->grid.columns, 3U);
    EXPECT_EQ(read->grid.rows, 2U);
    EXPECT_EQ(read->grid.pixel_mm, 0.1);
    EXPECT_EQ(read->height_mm, expected);
  }
}

TEST(HeightMapFile, ReadsLinesOfNumbers) {
  const auto read = parse_csv_heights("0.5, 0.5, inf\r\n\n0.7,0.5,0.5\n", "a", 0.1);
  ASSERT_TRUE(read) << refusal(read);
  EXPECT_EQ(read->height_mm[2], kInfinite);
  EXPECT_NEAR(read->height_mm[3], 0.2, 1e-12);
}

TEST(HeightMapFile, RefusesHeightsThatNoNumberCanHold) {
  for (const char* const height : {"1e400", "-1e400", "+1e999"}) {
    const auto read = parse_csv_heights(std::string("0,1\n1,") + height + "\n", "a", 0.1);
    EXPECT_NE(refusal(read).find("a:2: column 2 is"), std::string::npos) << refusal(read);
  }
}

TEST(HeightMapFile, SaysWhatIsWrongWithAFile) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto expect = [](const Expected<HeightMap, SetupError>& read, const std::string& words) {
    EXPECT_NE(refusal(read).find(words), std::string::npos) << refusal(read);
  };
  expect(parse_npy_heights("PK", "a", 0.1), "is not a NumPy file");
  expect(parse_npy_heights(npy<double>("(6,)", {1, 2, 3, 4, 5, 6}), "a", 0.1), "two dimensions");
  expect(parse_npy_heights(npy<double>("(1, 2, 3)", {1, 2, 3, 4, 5, 6}), "a", 0.1),
         "two dimensions");
  expect(parse_npy_heights(npy<double>("(2, 4)", {1, 2, 3, 4, 5, 6}), "a", 0.1), "as many numbers");
  expect(parse_npy_heights(npy<double>("(99999999999, 99999999999)", {1}), "a", 0.1),
         "more than 16777216");
  expect(parse_npy_heights(npy<double>("(2, 2)", {1, nan, 3, 4}), "a", 0.1), "row 1, column 2");
  expect(parse_npy_heights(npy<double>("(2, 2)", std::vector<double>(4, kInfinite)), "a", 0.1),
         "no finite height");
  std::string truncated = npy<double>("(2, 2)", {1, 2, 3, 4});
  truncated.resize(20);
  expect(parse_npy_heights(truncated, "a", 0.1), "ends within its header");
  expect(parse_csv_heights("1,2\n3\n", "a", 0.1), "a:2: this line has 1 heights");
  expect(parse_csv_heights("1,two\n3,4\n", "a", 0.1), "a:1: column 2 is not a number");
  expect(parse_csv_heights("1,nan\n3,4\n", "a", 0.1), "write inf where there is no tip");
  expect(parse_csv_heights("1,2\n", "a", 0.1), "fewer than two rows");
  expect(read_height_map("/no/such/file.npy", 0.1), "cannot read the shape");
  expect(read_height_map("/dev/zero", 0.1), "it is not a file");
}

}  // namespace
}  // namespace merkel
