#include "tools/doctor/cyclictest.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <vector>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "tools/child_process.hpp"
#include "tools/scratch_folder.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;

constexpr int kMax_us = 20'000;  ///< range of its histogram; longer latencies overflow

std::uint64_t whole(const nlohmann::json& value) {
  return value.is_number() ? value.get<std::uint64_t>() : 0;
}

}  // namespace

std::optional<LatencySummary> parse_cyclictest(const std::string& json) {
  const auto root = nlohmann::json::parse(json, nullptr, false);
  if (root.is_discarded() || !root.is_object()) return std::nullopt;
  const auto thread = root.value(nlohmann::json::json_pointer("/thread/0"), nlohmann::json());
  if (!thread.is_object() || !thread.value("histogram", nlohmann::json()).is_object()) {
    return std::nullopt;
  }
  std::map<std::int64_t, std::uint64_t> histogram;
  std::uint64_t in_histogram = 0;
  for (const auto& [key, count] : thread["histogram"].items()) {
    std::int64_t latency_us = 0;
    const auto end = std::from_chars(key.data(), key.data() + key.size(), latency_us);
    if (end.ec != std::errc{} || latency_us < 0) return std::nullopt;
    histogram[latency_us] += whole(count);
    in_histogram += whole(count);
  }
  LatencySummary summary;
  const std::uint64_t cycles = whole(thread.value("cycles", nlohmann::json()));
  summary.count = std::max(cycles, in_histogram);
  summary.longest =
      microseconds{static_cast<std::int64_t>(whole(thread.value("max", nlohmann::json())))};
  if (summary.count == 0) return std::nullopt;
  const auto quantile = [&](double fraction) -> std::chrono::nanoseconds {
    std::uint64_t so_far = 0;
    for (const auto& [latency_us, count] : histogram) {
      so_far += count;
      if (static_cast<double>(so_far) >= fraction * static_cast<double>(summary.count)) {
        return microseconds{latency_us};
      }
    }
    return summary.longest;
  };
  summary.p50 = quantile(0.5);
  summary.p99 = quantile(0.99);
  summary.p999 = quantile(0.999);
  return summary;
}

std::optional<LatencySummary> run_cyclictest(std::chrono::nanoseconds duration,
                                             std::chrono::nanoseconds interval,
                                             const RealtimeRights& rights) {
  const ScratchFolder folder("doctor");
  if (!folder.made()) return std::nullopt;
  const std::string file = folder.file("cyclictest.json");
  const auto seconds =
      std::max<std::int64_t>(1, std::chrono::duration_cast<std::chrono::seconds>(duration).count());
  const auto interval_us = std::chrono::duration_cast<microseconds>(interval).count();
  std::vector<std::string> words = {"cyclictest",
                                    "-q",
                                    "-t1",
                                    "-D",
                                    std::to_string(seconds),
                                    "-i",
                                    std::to_string(interval_us),
                                    "-h",
                                    std::to_string(kMax_us),
                                    "--json=" + file};
  if (rights.fifo) words.insert(words.end(), {"-p", std::to_string(rights.priority)});
  if (rights.memory_locked) words.emplace_back("-m");
  if (rights.cpu) words.insert(words.end(), {"-a", std::to_string(*rights.cpu)});
  const int exit_code = ChildProcess(words).wait();
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  if (exit_code != 0) return std::nullopt;
  return parse_cyclictest(text.str());
}

}  // namespace merkel
