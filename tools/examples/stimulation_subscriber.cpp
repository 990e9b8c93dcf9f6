// Prints what each electrode applies, by the commands of the sink stim-zmq, and switches off by
// itself when they end. c++ -std=c++20 stimulation_subscriber.cpp -lzmq -o subscriber &&
// ./subscriber tcp://127.0.0.1:5558
#include <cstdint>
#include <iostream>
#include <map>
#include <string>

#include <nlohmann/json.hpp>
#include <time.h>
#include <zmq.hpp>

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

int main(int /*argc*/, char** argv) {
  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::sub);
  socket.set(zmq::sockopt::subscribe, std::string("\x64\x00", 2));  // commands only
  socket.set(zmq::sockopt::rcvtimeo, 1);                            // ms
  socket.connect(argv[1]);
  std::map<std::string, std::int64_t> valid_until_ns;  // by electrode that is on
  const auto apply = [](const std::string& electrode, double amplitude_uA, double frequency_Hz) {
    std::cout << electrode << ' ' << amplitude_uA << ' ' << frequency_Hz << '\n'
              << std::flush;  // the stimulator
  };
  for (zmq::message_t head, text;;) {
    if (socket.recv(head) && socket.recv(text)) {
      const auto command = nlohmann::json::parse(text.to_string_view());
      const std::string name = command["electrode"];
      const double amplitude_uA = command["amplitude_uA"];
      const std::int64_t valid_ns = command["valid_until_ns"];
      if (amplitude_uA == 0.0 || monotonic_ns() < valid_ns) {  // an off always counts
        apply(name, amplitude_uA, command["frequency_Hz"]);
        valid_until_ns.erase(name);
        if (amplitude_uA > 0.0 && command["kind"] == "update") valid_until_ns[name] = valid_ns;
      }
    }
    std::erase_if(valid_until_ns, [&](const auto& each) {
      if (monotonic_ns() < each.second) return false;
      apply(each.first, 0.0, 0.0);
      return true;
    });
  }
}
