#include "drivers/sinks/nwb_objects.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <random>
#include <string_view>
#include <utility>

#include "core/printed.hpp"
#include "drivers/files/utc_text.hpp"
#include "drivers/printable_text.hpp"

namespace merkel::nwb {
namespace {

using Type = Hdf5File::Type;

constexpr double kSecondInNs = 1e9;
constexpr double kLargestExact_s = 9e6;   ///< times below it are whole ns as doubles
constexpr std::uint64_t kMinRegular = 3;  ///< fewer times have no rate

}  // namespace

std::string new_uuid() {
  static constexpr std::string_view kDigits = "0123456789abcdef";
  std::random_device random;
  std::string text = "xxxxxxxx-xxxx-4xxx-yxxx-xxxxxxxxxxxx";
  for (char& c : text) {
    const unsigned digit = random() & 15U;
    if (c == 'x') c = kDigits[digit];
    if (c == 'y') c = kDigits[8U | (digit & 3U)];
  }
  return text;
}

std::string iso_time(std::chrono::nanoseconds since_1970) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(since_1970);
  return utc_text(whole.count(), "%Y-%m-%dT%H:%M:%S") +
         printed(".%06d+00:00", static_cast<int>((since_1970 - whole).count() / 1000));
}

void make_typed(Hdf5File& file, const std::string& path, const char* space, const char* type) {
  file.attribute(path, "namespace", std::string(space));
  file.attribute(path, "neurodata_type", std::string(type));
  file.attribute(path, "object_id", new_uuid());
}

Table::Table(Hdf5File& file, std::string path, const char* type, const char* space,
             const std::vector<std::string>& columns, const std::string& description)
    : file_(file), path_(std::move(path)) {
  file_.group(path_);
  make_typed(file_, path_, space, type);
  file_.attribute(path_, "colnames", columns);
  file_.attribute(path_, "description", description);
  ids_ = std::make_unique<Hdf5File::Column>(file_, path_ + "/id", Type::kInt64);
  make_typed(file_, path_ + "/id", kCommon, "ElementIdentifiers");
}

Table::Column Table::column(const std::string& name, Type type, const std::string& description,
                            std::size_t width) {
  auto made = std::make_unique<Hdf5File::Column>(file_, path_ + "/" + name, type, width);
  describe(name, "VectorData", description);
  return made;
}

Table::Column Table::index_of(const std::string& name) {
  const std::string index = name + "_index";
  auto made = std::make_unique<Hdf5File::Column>(file_, path_ + "/" + index, Type::kUint32);
  describe(index, "VectorIndex", "Index of " + name);
  file_.reference(path_ + "/" + index, "target", path_ + "/" + name);
  return made;
}

void Table::texts(const std::string& name, const std::vector<std::string>& values,
                  const std::string& description) {
  file_.texts(path_ + "/" + name, values);
  describe(name, "VectorData", description);
}

void Table::describe(const std::string& name, const char* type, const std::string& description) {
  make_typed(file_, path_ + "/" + name, kCommon, type);
  file_.attribute(path_ + "/" + name, "description", description);
}

std::string SeriesPaths::take(std::string name) {
  name = utf8_text(name);
  std::replace(name.begin(), name.end(), '/', '_');
  std::string free = name;
  for (int number = 2; !taken_.insert(free).second; ++number) {
    free = name + "_" + std::to_string(number);
  }
  return folder_ + "/" + free;
}

TimeSeries::TimeSeries(Hdf5File& file, std::string path, Description description, TimeSeries* times)
    : file_(file), path_(std::move(path)), description_(std::move(description)) {
  (times == nullptr ? this : times)->series_.push_back(path_);
}

TimeSeries::~TimeSeries() {
  if (series_.empty() || count_ == 0) return;
  if (times_ || count_ < kMinRegular) {
    write_each_time();
    for (std::size_t i = 1; i < series_.size(); ++i) {
      file_.link(series_[i] + "/timestamps", path_ + "/timestamps");
    }
    return;
  }
  for (const std::string& each : series_) {
    const std::string start = each + "/starting_time";
    file_.number(start, static_cast<double>(first_ns_) / kSecondInNs);
    file_.attribute(start, "rate", kSecondInNs / static_cast<double>(step_ns_));
    file_.attribute(start, "unit", std::string("seconds"));
  }
}

void TimeSeries::append(double time_s, double value) {
  if (!values_) start();
  values_->append(value);
  if (!series_.empty()) append_time(time_s);
}

void TimeSeries::append_time(double time_s) {
  const bool near = std::fabs(time_s) < kLargestExact_s;
  const std::int64_t time_ns = near ? std::llround(time_s * kSecondInNs) : 0;
  if (count_ == 0) first_ns_ = time_ns;
  if (count_ == 1) step_ns_ = time_ns - first_ns_;
  const bool regular = near && static_cast<double>(time_ns) / kSecondInNs == time_s &&
                       time_ns == first_ns_ + static_cast<std::int64_t>(count_) * step_ns_ &&
                       (count_ == 0 || step_ns_ > 0);
  if (!regular && !times_) write_each_time();
  if (times_) times_->append(time_s);
  ++count_;
}

/// Writes the times so far, which were regular, and begins to write each time.
void TimeSeries::write_each_time() {
  if (times_) return;
  const std::string path = path_ + "/timestamps";
  times_ = std::make_unique<Hdf5File::Column>(file_, path, Type::kDouble);
  file_.attribute(path, "unit", std::string("seconds"));
  file_.attribute(path, "interval", std::int32_t{1});
  for (std::uint64_t i = 0; i < count_; ++i) {
    const std::int64_t time_ns = first_ns_ + static_cast<std::int64_t>(i) * step_ns_;
    times_->append(static_cast<double>(time_ns) / kSecondInNs);
  }
}

void TimeSeries::start() {
  file_.group(path_);
  make_typed(file_, path_, kCore, "TimeSeries");
  file_.attribute(path_, "description", description_.description);
  file_.attribute(path_, "comments", description_.comments);
  const std::string data = path_ + "/data";
  values_ = std::make_unique<Hdf5File::Column>(file_, data, Type::kDouble);
  file_.attribute(data, "unit", description_.unit);
  file_.attribute(data, "conversion", description_.conversion);
  file_.attribute(data, "resolution", -1.0F);
  file_.attribute(data, "offset", 0.0F);
}

}  // namespace merkel::nwb
