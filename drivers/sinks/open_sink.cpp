#include "drivers/sinks/open_sink.hpp"

#include "drivers/sinks/phy_spike_sink.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/text_spike_sink.hpp"

namespace merkel {
namespace {

template <TextSpikeSink::Form form>
OpenedSink open_text_sink(const Uri& uri, const SinkSetup& setup) {
  if (auto done = UriOptions(uri).finish(); !done) return Unexpected<SetupError>(done.error());
  return TextSpikeSink::open(uri.text, uri.path, form, setup.overwrite);
}

struct Scheme {
  std::string_view name;
  std::string_view usage;
  OpenedSink (*open)(const Uri&, const SinkSetup&);  ///< null where the library is missing
  std::string_view mend;                             ///< how to get the library
};

constexpr Scheme kSchemes[] = {
    {"csv", "csv:FILE", open_text_sink<TextSpikeSink::Form::kCsv>, ""},
    {"gdf", "gdf:FILE", open_text_sink<TextSpikeSink::Form::kGdf>, ""},
    {"phy", "phy:DIR", PhySpikeSink::open, ""},
    {"sonata", "sonata:FILE.h5",
#ifdef MERKEL_WITH_HDF5
     open_sonata_sink,
#else
     nullptr,
#endif
     "HDF5: install libhdf5-dev"},
    {"xdf", "xdf:FILE", open_xdf_sink, ""},
    {"zmq", "zmq:tcp://127.0.0.1:5557",
#ifdef MERKEL_WITH_ZMQ
     open_zmq_sink,
#else
     nullptr,
#endif
     "ZeroMQ: install libzmq3-dev and cppzmq-dev"},
    {"osc", "osc:HOST:PORT",
#ifdef MERKEL_WITH_LIBLO
     open_osc_sink,
#else
     nullptr,
#endif
     "liblo: install liblo-dev"},
    {"lsl", "lsl:NAME",
#ifdef MERKEL_WITH_LSL
     open_lsl_sink,
#else
     nullptr,
#endif
     "liblsl, which Debian does not have: install a package from "
     "https://github.com/sccn/liblsl/releases"},
    {"view", "view:8080",
#ifdef MERKEL_WITH_BEAST
     open_view_sink,
#else
     nullptr,
#endif
     "Boost.Beast: install libboost-dev"},
};

}  // namespace

std::string sink_schemes() {
  std::string list;
  for (const Scheme& scheme : kSchemes) list.append(list.empty() ? "" : ", ").append(scheme.usage);
  return list;
}

Expected<std::unique_ptr<SpikeSink>, SetupError> open_sink(std::string_view text,
                                                           const SinkSetup& setup) {
  const auto uri = Uri::parse(text);
  if (!uri) return Unexpected<SetupError>(uri.error());
  for (const Scheme& scheme : kSchemes) {
    if (uri->scheme != scheme.name) continue;
    if (scheme.open != nullptr) return scheme.open(*uri, setup);
    return bad_input("\"" + uri->text + "\": this merkel was built without " +
                     std::string(scheme.mend) + ", then configure and build merkel again");
  }
  return bad_input("\"" + uri->text + "\": there is no sink scheme \"" + uri->scheme +
                   "\"; known are " + sink_schemes());
}

Expected<std::unique_ptr<SpikeSink>, SetupError> open_sink(std::string_view uri,
                                                           std::uint32_t neurons, bool overwrite) {
  return open_sink(
      uri, SinkSetup{.neurons = neurons, .overwrite = overwrite, .allow_remote = false, .run = {}});
}

}  // namespace merkel
