// A replacement for the part of liblsl's C++ interface that merkel's inlet and its test use;
// streams stay within the process. Debian has no liblsl. If it is installed, the same test uses the
// library.
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

namespace lsl {

enum channel_format_t { cf_undefined = 0, cf_float32 = 1, cf_double64 = 2, cf_string = 3 };
enum processing_options_t { post_none = 0, post_clocksync = 1 };
inline constexpr double IRREGULAR_RATE = 0.0;

class timeout_error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
class lost_error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline double local_clock() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// An element of a stream's description.
class xml_element {
  struct Node {
    std::string name;
    std::string value;
    std::list<std::shared_ptr<Node>> children;
    Node* parent = nullptr;
  };

 public:
  xml_element() : node_(std::make_shared<Node>()) {}
  [[nodiscard]] xml_element child(const std::string& name) const {
    if (node_) {
      for (const auto& each : node_->children) {
        if (each->name == name) return xml_element(each);
      }
    }
    return xml_element(nullptr);
  }
  [[nodiscard]] xml_element next_sibling(const std::string& name) const {
    if (!node_ || node_->parent == nullptr) return xml_element(nullptr);
    auto& siblings = node_->parent->children;
    auto at = std::find(siblings.begin(), siblings.end(), node_);
    while (at != siblings.end() && ++at != siblings.end()) {
      if ((*at)->name == name) return xml_element(*at);
    }
    return xml_element(nullptr);
  }
  [[nodiscard]] const char* child_value(const std::string& name) const {
    const xml_element found = child(name);
    return found.node_ ? found.node_->value.c_str() : "";
  }
  xml_element append_child(const std::string& name) {
    auto made = std::make_shared<Node>();
    made->name = name;
    made->parent = node_.get();
    node_->children.push_back(made);
    return xml_element(made);
  }
  xml_element append_child_value(const std::string& name, const std::string& value) {
    append_child(name).node_->value = value;
    return *this;
  }

 private:
  explicit xml_element(std::shared_ptr<Node> node) : node_(std::move(node)) {}
  std::shared_ptr<Node> node_;
};

class stream_info {
 public:
  stream_info(std::string name, std::string type, int channels, double rate,
              channel_format_t format, std::string source)
      : name_(std::move(name)),
        type_(std::move(type)),
        source_(std::move(source)),
        channels_(channels),
        rate_(rate),
        format_(format) {}
  [[nodiscard]] std::string name() const { return name_; }
  [[nodiscard]] std::string source_id() const { return source_; }
  [[nodiscard]] std::string uid() const { return name_ + source_; }
  [[nodiscard]] std::string hostname() const {
    char text[256] = {};
    ::gethostname(text, sizeof text - 1);
    return text;
  }
  [[nodiscard]] int channel_count() const { return channels_; }
  [[nodiscard]] double nominal_srate() const { return rate_; }
  [[nodiscard]] channel_format_t channel_format() const { return format_; }
  [[nodiscard]] xml_element desc() { return description_; }  // not const, as in liblsl

 private:
  std::string name_;
  std::string type_;
  std::string source_;
  int channels_;
  double rate_;
  channel_format_t format_;
  xml_element description_;
};

/// What an outlet and its inlets share.
struct Line {
  explicit Line(stream_info of) : info(std::move(of)) {}
  stream_info info;
  std::mutex mutex;
  std::condition_variable more;
  std::deque<std::pair<double, std::vector<double>>> samples;
  bool open = true;
};

inline std::vector<std::shared_ptr<Line>>& lines() {
  static std::vector<std::shared_ptr<Line>> all;
  return all;
}

class stream_outlet {
 public:
  explicit stream_outlet(const stream_info& info) : line_(std::make_shared<Line>(info)) {
    lines().push_back(line_);
  }
  stream_outlet(const stream_outlet&) = delete;
  stream_outlet& operator=(const stream_outlet&) = delete;
  ~stream_outlet() {
    const std::scoped_lock lock(line_->mutex);
    line_->open = false;
    line_->more.notify_all();
    std::erase(lines(), line_);
  }
  void push_sample(const std::vector<double>& values, double time_s = 0.0) {
    const std::scoped_lock lock(line_->mutex);
    line_->samples.emplace_back(time_s == 0.0 ? local_clock() : time_s, values);
    line_->more.notify_all();
  }

 private:
  std::shared_ptr<Line> line_;
};

inline std::vector<stream_info> resolve_stream(const std::string& property,
                                               const std::string& value, int /*least*/,
                                               double /*timeout_s*/) {
  std::vector<stream_info> found;
  for (const auto& line : lines()) {
    if (property == "name" && line->info.name() == value) found.push_back(line->info);
  }
  return found;
}

class continuous_resolver {
 public:
  continuous_resolver(std::string property, std::string value, double /*forget_s*/ = 5.0)
      : property_(std::move(property)), value_(std::move(value)) {}
  [[nodiscard]] std::vector<stream_info> results() const {
    return resolve_stream(property_, value_, 0, 0.0);
  }

 private:
  std::string property_;
  std::string value_;
};

/// The clock of this machine minus that of the outlets.
inline double& offset_s() {
  static double offset = 0.0;
  return offset;
}

class stream_inlet {
 public:
  explicit stream_inlet(const stream_info& info, int /*buffered_s*/ = 360, int /*chunk*/ = 0,
                        bool /*recover*/ = true) {
    for (const auto& line : lines()) {
      if (line->info.name() == info.name() && line->info.source_id() == info.source_id())
        line_ = line;
    }
    if (!line_) throw lost_error("the outlet is gone");
  }
  void open_stream(double /*timeout_s*/) {}
  void set_postprocessing(std::uint32_t flags) {
    if ((flags & post_clocksync) != 0U) correction_s_ = time_correction(0.0);
  }
  /// As liblsl measures it to an outlet of the same machine; offset_s() for one with another clock.
  double time_correction(double /*timeout_s*/) const { return offset_s() - 17e-6; }
  [[nodiscard]] stream_info info(double /*timeout_s*/) const { return line_->info; }
  double pull_sample(std::vector<double>& values, double timeout_s) {
    std::unique_lock lock(line_->mutex);
    line_->more.wait_for(lock, std::chrono::duration<double>(timeout_s),
                         [this] { return !line_->samples.empty() || !line_->open; });
    if (line_->samples.empty()) {
      if (!line_->open) throw lost_error("the outlet is gone");
      return 0.0;
    }
    const double time_s = line_->samples.front().first;
    values = line_->samples.front().second;
    line_->samples.pop_front();
    return time_s + correction_s_;
  }

 private:
  std::shared_ptr<Line> line_;
  double correction_s_ = 0.0;
};

}  // namespace lsl
