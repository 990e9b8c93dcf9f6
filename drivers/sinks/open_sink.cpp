#include "drivers/sinks/open_sink.hpp"

#include <algorithm>
#include <chrono>

#include "drivers/files/dated_name.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/lsl_library.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/sinks/phy_sink.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/text_sink.hpp"

namespace merkel {
namespace {

template <TextSink::Form form>
OpenedSink open_text_sink(const Uri& uri, const SinkSetup& setup) {
  return TextSink::open(uri, uri.path, form, setup);
}

struct Scheme {
  std::string_view name;
  std::string_view usage;
  std::string_view options;
  OpenedSink (*open)(const Uri&, const SinkSetup&);  ///< null if the library is missing
  std::string_view remedy;                           ///< how to get the library
  bool file = false;                                 ///< writes a file, so that %t is the time
  /// Converts the renamed rows of a killed run; null if they are the file.
  void (*convert)(const std::string&, const SinkSetup&) = nullptr;
};

constexpr Scheme kSchemes[] = {
    {"csv", "csv:FILE", "time", open_text_sink<TextSink::Form::kCsv>, "", true},
    {"gdf", "gdf:FILE", "time", open_text_sink<TextSink::Form::kGdf>, "", true},
    {"trace", "trace:FILE.csv", "time", open_trace_sink, "", true},
    {"phy", "phy:DIR", "sample_rate (1000000), time", PhySink::open, "", true},
    {"sonata", "sonata:FILE.h5", "population (merkel), time",
#ifdef MERKEL_WITH_HDF5
     open_sonata_sink, "", true, convert_recovered_sonata},
#else
     nullptr, "HDF5: install libhdf5-dev", true},
#endif
    {"nwb", "nwb:FILE.nwb", "time",
#ifdef MERKEL_WITH_HDF5
     open_nwb_sink, "", true, convert_recovered_nwb},
#else
     nullptr, "HDF5: install libhdf5-dev", true},
#endif
    {"xdf", "xdf:FILE", "frames (0)", open_xdf_sink, "", true},
    {"zmq", "zmq:tcp://127.0.0.1:5557",
     "topic, stream, hwm (100000), when_full (drop), subscribers, wait_s",
#ifdef MERKEL_WITH_ZMQ
     open_zmq_sink,
#else
     nullptr,
#endif
     "ZeroMQ: install libzmq3-dev and cppzmq-dev"},
    {"stim-csv", "stim-csv:FILE", "time", open_stim_csv_sink, "", true},
    {"stim-zmq", "stim-zmq:tcp://127.0.0.1:5558",
     "topic, stream, hwm (100000), when_full (drop), subscribers, wait_s",
#ifdef MERKEL_WITH_ZMQ
     open_stim_zmq_sink,
#else
     nullptr,
#endif
     "ZeroMQ: install libzmq3-dev and cppzmq-dev"},
    {"redis", "redis:127.0.0.1:6379", "node (merkel), maxlen (100000)",
#ifdef MERKEL_WITH_HIREDIS
     open_redis_sink,
#else
     nullptr,
#endif
     "hiredis: install libhiredis-dev"},
    {"osc", "osc:HOST:PORT", "path",
#ifdef MERKEL_WITH_LIBLO
     open_osc_sink,
#else
     nullptr,
#endif
     "liblo: install liblo-dev"},
    {"lsl", "lsl:NAME", "wait_s",
#ifdef MERKEL_WITH_LSL
     open_lsl_sink,
#else
     nullptr,
#endif
     kLslLibrary},
    {"view", "view:8080", "rate_hz (25), control (0)",
#ifdef MERKEL_WITH_BEAST
     open_view_sink,
#else
     nullptr,
#endif
     "Boost.Beast: install libboost-dev"},
};

/// Recovers the files of killed runs with the same pattern of names.
void recover_runs(const Scheme& scheme, const Uri& uri, const SinkSetup& setup) {
  for (const std::string& name : unfinished_names(uri.path)) {
    if (uri.scheme == "phy" || recover_file(name, setup.notice).empty()) continue;
    if (scheme.convert != nullptr) scheme.convert(name, setup);
  }
}

/// The files that a run reads.
std::vector<std::string> inputs_of(const SinkSetup& setup) {
  std::vector<std::string> files = setup.inputs;
  for (const ProbeInfo& probe : setup.run.probes) {
    for (std::string& file : files_of_probe(probe.uri)) files.push_back(std::move(file));
    if (!probe.calibration_file.empty()) files.push_back(probe.calibration_file);
  }
  return files;
}

}  // namespace

std::string sink_schemes() {
  std::string list;
  for (const Scheme& scheme : kSchemes) list.append(list.empty() ? "" : ", ").append(scheme.usage);
  return list;
}

std::string sink_options_help() {
  std::string text = "Sinks and their options, SINK?option=value&...:";
  for (const Scheme& scheme : kSchemes) {
    text.append("\n  ").append(scheme.usage);
    if (!scheme.options.empty()) text.append(": ").append(scheme.options);
  }
  return text + "\n  time is run, unix or device; %t in a file's name becomes the date and time";
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
      uri->path = dated_name(uri->path, std::chrono::system_clock::now());
      if (auto safe = check_not_input(uri->path, inputs_of(setup)); !safe) {
        return Unexpected<SetupError>(safe.error());
      }
    }
    return scheme.open(*uri, setup);
  }
  return bad_input("\"" + uri->text + "\": there is no sink scheme \"" + uri->scheme +
                   "\"; the known ones are " + sink_schemes());
}

Expected<std::unique_ptr<Sink>, SetupError> open_sink(std::string_view uri, std::uint32_t neurons,
                                                      bool overwrite) {
  return open_sink(
      uri, SinkSetup{.neurons = neurons, .overwrite = overwrite, .allow_remote = false, .run = {}});
}

}  // namespace merkel
