// Reads an XDF file with Debian's libxdf: libxdf_reader FILE OUT prints a line for each stream, its
// times in OUT/K.times, its values (which libxdf keeps in single precision) in OUT/K.values.
#include <cstdio>
#include <fstream>
#include <string>

#include <xdf.h>

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  Xdf file;
  if (file.load_xdf(argv[1]) != 0) return 1;
  int number = 0;
  for (const Xdf::Stream& stream : file.streams) {
    const std::string out = std::string(argv[2]) + "/" + std::to_string(++number);
    std::printf("stream %d %s %g %d %zu\n", number, stream.info.name.c_str(),
                stream.info.nominal_srate, stream.info.channel_count, stream.time_stamps.size());
    std::ofstream times(out + ".times", std::ios::binary);
    for (const double each : stream.time_stamps) {
      times.write(reinterpret_cast<const char*>(&each), sizeof each);
    }
    std::ofstream values(out + ".values", std::ios::binary);
    for (std::size_t i = 0; i < stream.time_stamps.size(); ++i) {
      for (const auto& channel : stream.time_series) {
        const double value = i < channel.size() ? static_cast<double>(channel[i]) : 0.0;
        values.write(reinterpret_cast<const char*>(&value), sizeof value);
      }
    }
  }
  return 0;
}
