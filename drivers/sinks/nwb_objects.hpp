#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "drivers/files/hdf5_file.hpp"

/// The kinds of objects in an NWB file (nwb-schema.readthedocs.io), as HDF5 stores them.
namespace merkel::nwb {

/// Namespaces of NWB's types.
inline constexpr const char* kCore = "core";
inline constexpr const char* kCommon = "hdmf-common";

/// A random UUID (version 4).
[[nodiscard]] std::string new_uuid();

/// "2026-01-31T12:00:00.000000+00:00".
[[nodiscard]] std::string iso_time(std::chrono::nanoseconds since_1970);

/// Gives an object its type and a new object_id.
void make_typed(Hdf5File& file, const std::string& path, const char* space, const char* type);

/// A DynamicTable: a group with columns of equal length.
class Table {
 public:
  using Column = std::unique_ptr<Hdf5File::Column>;

  Table(Hdf5File& file, std::string path, const char* type, const char* space,
        const std::vector<std::string>& columns, const std::string& description);

  void add_row() { ids_->append(rows_++); }
  [[nodiscard]] Column column(const std::string& name, Hdf5File::Type type,
                              const std::string& description, std::size_t width = 1);
  /// The end of each row's values in another column.
  [[nodiscard]] Column index_of(const std::string& name);
  void texts(const std::string& name, const std::vector<std::string>& values,
             const std::string& description);

 private:
  void describe(const std::string& name, const char* type, const std::string& description);

  Hdf5File& file_;
  std::string path_;
  Column ids_;
  std::uint64_t rows_ = 0;
};

/// The paths of the time series in one folder.
class SeriesPaths {
 public:
  explicit SeriesPaths(std::string folder) : folder_(std::move(folder)) {}
  /// A path that no other series has: with the name, whose slashes become "_", and if it is taken
  /// with "_2", "_3", … behind it.
  [[nodiscard]] std::string take(std::string name);

 private:
  std::string folder_;
  std::set<std::string> taken_{"", "."};  ///< to HDF5, both are the folder
};

/// A TimeSeries: values, each with its time. Without values it is not in the file: nwbinspector
/// stops at an empty one.
class TimeSeries {
 public:
  struct Description {
    std::string unit;         ///< NWB's name of it: meters, newtons
    float conversion = 1.0F;  ///< from the values to that unit
    std::string description;
    std::string comments;
  };

  /// \param times  another series with the same times, and as many values; null: its own
  TimeSeries(Hdf5File& file, std::string path, Description description,
             TimeSeries* times = nullptr);
  TimeSeries(const TimeSeries&) = delete;
  TimeSeries& operator=(const TimeSeries&) = delete;
  /// Writes the times: of a regular series its start and rate.
  ~TimeSeries();

  /// Appends a value. The time is ignored if another series has the times.
  void append(double time_s, double value);

 private:
  void start();
  void append_time(double time_s);
  void write_each_time();

  Hdf5File& file_;
  std::string path_;
  Description description_;
  std::unique_ptr<Hdf5File::Column> values_;  ///< null before the first one
  std::vector<std::string> series_;           ///< the paths of those with these times
  std::unique_ptr<Hdf5File::Column> times_;   ///< of an irregular series
  std::uint64_t count_ = 0;
  std::int64_t first_ns_ = 0;
  std::int64_t step_ns_ = 0;
};

}  // namespace merkel::nwb
