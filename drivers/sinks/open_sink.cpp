#include "drivers/sinks/open_sink.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <map>
#include <system_error>

#include <sys/stat.h>
#include <unistd.h>

#include "core/parameters/nearest_name.hpp"
#include "drivers/files/dated_name.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/lsl_library.hpp"
#include "drivers/sinks/export_sink.hpp"
#include "drivers/sinks/run_journal.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

struct Scheme {
  std::string_view name;
  std::string_view usage;
  std::string_view options;
  OpenedSink (*open)(const Uri&, const SinkSetup&);  ///< null if the library is missing
  std::string_view remedy;                           ///< how to get the library
  bool file = false;                                 ///< writes a file, so that %t is the time
  bool exported = false;                             ///< made from the run's journal (ExportSink)
};

constexpr Scheme kSchemes[] = {
    {"csv", "csv:FILE", "time", open_csv_sink, "", true},
    {"gdf", "gdf:FILE", "time", open_gdf_sink, "", true},
    {"trace", "trace:FILE.csv", "time", open_trace_sink, "", true},
    {"phy", "phy:DIR", "sample_rate (1000000), time", open_phy_sink, "", true, true},
    {"sonata", "sonata:FILE.h5", "population (merkel), time",
     MERKEL_WITH_HDF5 ? open_sonata_sink : nullptr, "HDF5: install libhdf5-dev", true, true},
    {"nwb", "nwb:FILE.nwb",
     "time, experimenter, institution, lab, experiment_description, keywords, subject_id, "
     "species, sex, age",
     MERKEL_WITH_HDF5 ? open_nwb_sink : nullptr, "HDF5: install libhdf5-dev", true, true},
    {"xdf", "xdf:FILE", "frames (0)", open_xdf_sink, "", true},
    {"zmq", "zmq:tcp://127.0.0.1:5557",
     "topic, stream, hwm (100000), when_full (drop), subscribers, wait_s",
     MERKEL_WITH_ZMQ ? open_zmq_sink : nullptr, "ZeroMQ: install libzmq3-dev and cppzmq-dev"},
    {"stim-csv", "stim-csv:FILE", "time", open_stim_csv_sink, "", true},
    {"stim-zmq", "stim-zmq:tcp://127.0.0.1:5558",
     "topic, stream, hwm (100000), when_full (drop), subscribers, wait_s",
     MERKEL_WITH_ZMQ ? open_stim_zmq_sink : nullptr, "ZeroMQ: install libzmq3-dev and cppzmq-dev"},
    {"redis", "redis:127.0.0.1:6379", "node (merkel), maxlen (100000), bin_ms (10)",
     MERKEL_WITH_HIREDIS ? open_redis_sink : nullptr, "hiredis: install libhiredis-dev"},
    {"osc", "osc:HOST:PORT", "path, types (iiiiii)", MERKEL_WITH_LIBLO ? open_osc_sink : nullptr,
     "liblo: install liblo-dev"},
    {"lsl", "lsl:NAME", "wait_s", MERKEL_WITH_LSL ? open_lsl_sink : nullptr, kLslLibrary},
    {"view", "view:8080", "rate_hz (25), control (0)", MERKEL_WITH_BEAST ? open_view_sink : nullptr,
     "Boost.Beast: install libboost-dev"},
};

/// Recovers the files of killed runs with the same pattern of names.
void recover_runs(const Scheme& scheme, const Uri& uri, const SinkSetup& setup) {
  const auto notice = scheme.exported ? ExportSink::recovering(uri, setup).notice : setup.notice;
  const std::string pattern = scheme.exported ? ExportSink::journal_name(uri.path) : uri.path;
  for (const std::string& name : unfinished_names(pattern)) {
    static_cast<void>(recover_file(name, notice));
  }
}

bool writes_file(const Uri& uri) {
  return std::any_of(std::begin(kSchemes), std::end(kSchemes), [&](const Scheme& scheme) {
    return scheme.file && scheme.name == uri.scheme;
  });
}

/// The file that a sink writes, by whatever path of its folder; empty for a pipe or device.
std::filesystem::path file_of(const std::string& text) {
  const auto uri = Uri::parse(text);
  if (!uri || !writes_file(*uri)) return {};
  if (uri->path == "-") return uri->path;
  if (is_special_output(uri->path)) return {};
  std::error_code ignored;
  const auto path = std::filesystem::absolute(uri->path, ignored);
  return std::filesystem::weakly_canonical(path.parent_path(), ignored) / path.filename();
}

/// Fails if two sinks write one file: with --overwrite the last one would replace the others.
Expected<void, SetupError> check_apart(std::span<const std::string> uris) {
  std::map<std::filesystem::path, std::string> sinks;
  for (const std::string& uri : uris) {
    const auto file = file_of(uri);
    if (file.empty()) continue;
    if (const auto [other, added] = sinks.emplace(file, uri); !added) {
      return bad_input("the sinks \"" + other->second + "\" and \"" + uri +
                       "\" write the same file: give one of them another name");
    }
  }
  return {};
}

}  // namespace

std::string sink_schemes() { return listed(kSchemes, &Scheme::usage); }

std::string sink_options_help() {
  std::string text = "Sinks and their options, SINK?option=value&...:";
  for (const Scheme& scheme : kSchemes) {
    text.append("\n  ").append(scheme.usage);
    if (!scheme.options.empty()) text.append(": ").append(scheme.options);
  }
  return text + "\n  time is run, unix or device; %t in a file's name becomes the date and time";
}

bool writes_standard_output(std::string_view sink) {
  const auto uri = Uri::parse(sink);
  const bool file = uri && writes_file(*uri);
  if (!file || uri->path == "-") return file;
  struct stat named {};
  struct stat output {};
  return ::stat(uri->path.c_str(), &named) == 0 && ::fstat(STDOUT_FILENO, &output) == 0 &&
         named.st_dev == output.st_dev && named.st_ino == output.st_ino;
}

Expected<std::unique_ptr<Sink>, SetupError> open_sink(std::string_view text,
                                                      const SinkSetup& setup) {
  auto uri = Uri::parse(text);
  if (!uri) return Unexpected<SetupError>(uri.error());
  for (const Scheme& scheme : kSchemes) {
    if (uri->scheme != scheme.name) continue;
    if (scheme.open == nullptr) {
      return bad_input("\"" + uri->text + "\": this merkel was built without " +
                       std::string(scheme.remedy) + ", then configure and build merkel again");
    }
    if (scheme.file) {
      recover_runs(scheme, *uri, setup);
      const auto now = std::chrono::system_clock::now();
      uri->path = dated_name(uri->path, now);
      uri->text = dated_name(uri->text, now);
    }
    return scheme.open(*uri, setup);
  }
  return bad_input("\"" + uri->text + "\": there is no sink scheme \"" + uri->scheme +
                   "\"; the known ones are " + sink_schemes());
}

Expected<std::vector<std::unique_ptr<Sink>>, SetupError> open_separate_sinks(
    std::span<const std::string> uris, const SinkSetup& setup) {
  if (auto apart = check_apart(uris); !apart) return Unexpected<SetupError>(apart.error());
  std::vector<std::unique_ptr<Sink>> sinks;
  for (const std::string& uri : uris) {
    auto sink = open_sink(uri, setup);
    if (!sink) return Unexpected<SetupError>(sink.error());
    sinks.push_back(std::move(*sink));
  }
  return sinks;
}

Expected<std::vector<std::unique_ptr<Sink>>, SetupError> open_sinks(
    std::span<const std::string> uris, SinkSetup setup) {
  if (auto apart = check_apart(uris); !apart) return Unexpected<SetupError>(apart.error());
  const auto session = std::find_if(uris.begin(), uris.end(), [](const std::string& text) {
    const auto uri = Uri::parse(text);
    return uri && uri->scheme == "xdf" && !is_special_output(uri->path);
  });
  const auto journal = std::make_shared<SessionJournal>();
  if (session != uris.end()) setup.journal = journal;
  std::vector<std::unique_ptr<Sink>> sinks;
  for (auto uri = uris.begin(); uri != uris.end(); ++uri) {
    setup.session_journal = uri == session ? journal : nullptr;
    auto sink = open_sink(*uri, setup);
    if (!sink) return Unexpected<SetupError>(sink.error());
    sinks.push_back(std::move(*sink));
  }
  return sinks;
}

Expected<std::unique_ptr<Sink>, SetupError> open_sink(std::string_view uri, std::uint32_t neurons,
                                                      bool overwrite) {
  return open_sink(
      uri, SinkSetup{.neurons = neurons, .overwrite = overwrite, .allow_remote = false, .run = {}});
}

}  // namespace merkel
