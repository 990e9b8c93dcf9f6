#include "drivers/protocols/text_row.hpp"

#include <algorithm>
#include <cstdint>

#include <nlohmann/json.hpp>

namespace merkel {
namespace {

using Json = nlohmann::json;

/// Collects the values of a text while it is parsed.
class JsonRow final : public nlohmann::json_sax<Json> {
 public:
  explicit JsonRow(TextRow& row) : row_(row) {}

  bool null() override { return add("nan"); }
  bool boolean(bool value) override { return add(value ? "1" : "0"); }
  bool number_integer(std::int64_t value) override { return add(std::to_string(value)); }
  bool number_unsigned(std::uint64_t value) override { return add(std::to_string(value)); }
  bool number_float(double /*value*/, const std::string& text) override { return add(text); }
  bool string(std::string& text) override { return add(text); }
  bool binary(Json::binary_t& /*bytes*/) override { return false; }
  bool start_object(std::size_t /*size*/) override { return open(false); }
  bool start_array(std::size_t /*size*/) override { return open(true); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(std::string& name) override {
    levels_.back().key = name;
    return true;
  }
  bool parse_error(std::size_t /*at*/, const std::string& /*token*/,
                   const Json::exception& /*error*/) override {
    return false;
  }

 private:
  static constexpr std::size_t kDeepest = 8;
  struct Level {
    std::string prefix;  ///< of its values
    bool list = false;   ///< numbered, on and on through the lists within
    std::size_t count = 0;
    std::string key;
  };

  /// What the next value is called; empty: nothing.
  std::string name() {
    Level& level = levels_.back();
    if (level.list) {
      ++level.count;
      return level.prefix.empty() ? "" : numbered_column(level.prefix, level.count);
    }
    return level.prefix.empty() ? level.key : level.prefix + "_" + level.key;
  }

  bool add(std::string_view text) {
    if (levels_.empty() || row_.values.size() == TextRow::kMaxValues) return false;
    std::string called = name();
    if (!called.empty()) row_.names.push_back(std::move(called));
    row_.values.emplace_back(text);
    return row_.names.empty() || row_.names.size() == row_.values.size();
  }

  bool open(bool list) {
    if (levels_.size() == kDeepest) return false;
    Level level{.prefix = {}, .list = list, .key = {}};
    if (!levels_.empty()) {
      const bool within = list && levels_.back().list;
      level.count = within ? levels_.back().count : 0;
      level.prefix = within ? levels_.back().prefix : name();
    }
    levels_.push_back(std::move(level));
    return true;
  }

  bool close() {
    const Level closed = std::move(levels_.back());
    levels_.pop_back();
    if (closed.list && !levels_.empty() && levels_.back().list) levels_.back().count = closed.count;
    return true;
  }

  TextRow& row_;
  std::vector<Level> levels_;
};

}  // namespace

bool read_json_row(std::string_view line, TextRow& row) {
  row.names.clear();
  row.values.clear();
  JsonRow reader(row);
  return Json::sax_parse(line.begin(), line.end(), &reader) && !row.values.empty();
}

std::string numbered_column(std::string_view name, std::size_t number) {
  const auto unit = std::min(name.rfind('_'), name.size());
  return std::string(name.substr(0, unit)) + std::to_string(number) +
         std::string(name.substr(unit));
}

}  // namespace merkel
