#include "drivers/transports/hid_port.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include <dlfcn.h>
#include <hidapi/hidapi.h>
#include <unistd.h>

#include "drivers/transports/descriptor.hpp"

namespace merkel {
namespace {

/// The functions of one of hidapi's backends.
struct Hidapi {
  decltype(&::hid_init) init = nullptr;
  decltype(&::hid_enumerate) enumerate = nullptr;
  decltype(&::hid_free_enumeration) free_enumeration = nullptr;
  decltype(&::hid_open_path) open_path = nullptr;
  decltype(&::hid_close) close = nullptr;
  decltype(&::hid_read_timeout) read_timeout = nullptr;
  decltype(&::hid_write) write = nullptr;

  [[nodiscard]] static Expected<Hidapi, SetupError> load(HidBackend backend) {
    const char* const library =
        backend == HidBackend::kHidraw ? "libhidapi-hidraw.so.0" : "libhidapi-libusb.so.0";
    // Stays loaded until the program ends, because devices may be open in it.
    void* const handle = ::dlopen(library, RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) {
      return unavailable(
          std::string("HID devices are read by ") + library +
          ", which is missing: install the package " +
          (backend == HidBackend::kHidraw ? "libhidapi-hidraw0" : "libhidapi-libusb0"));
    }
    Hidapi hidapi;
    bool whole = true;
    const auto find = [&](const char* name, auto& function) {
      function =
          reinterpret_cast<std::remove_reference_t<decltype(function)>>(::dlsym(handle, name));
      whole = whole && function != nullptr;
    };
    find("hid_init", hidapi.init);
    find("hid_enumerate", hidapi.enumerate);
    find("hid_free_enumeration", hidapi.free_enumeration);
    find("hid_open_path", hidapi.open_path);
    find("hid_close", hidapi.close);
    find("hid_read_timeout", hidapi.read_timeout);
    find("hid_write", hidapi.write);
    if (!whole || hidapi.init() != 0) {
      return unavailable(std::string(library) + " cannot be used: install its Debian package");
    }
    return hidapi;
  }
};

std::string narrow(const wchar_t* text) {
  std::string result;
  for (; text != nullptr && *text != L'\0'; ++text) {
    result += *text >= L' ' && *text < L'\x7f' ? static_cast<char>(*text) : '?';
  }
  return result;
}

/// The descriptor as the kernel has read it; hidapi only provides it from version 0.14 on.
/// \param path  in hidapi's form: "/dev/hidraw0" or "1-2:1.1"
std::vector<std::uint8_t> report_descriptor_of(const std::string& path) {
  constexpr const char* kFile = "report_descriptor";
  std::error_code ignored;
  std::filesystem::path place;
  if (path.starts_with('/')) {
    place = "/sys/class/hidraw" + path.substr(path.rfind('/')) + "/device";
  } else {
    for (const auto& entry :
         std::filesystem::directory_iterator("/sys/bus/usb/devices/" + path, ignored)) {
      if (std::filesystem::exists(entry.path() / kFile, ignored)) place = entry.path();
    }
  }
  std::ifstream file(place / kFile, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class HidPort final : public Transport {
 public:
  HidPort(const Hidapi& hidapi, UsbName name, HidBackend backend)
      : hidapi_(hidapi), name_(std::move(name)) {
    info_.name = "hid:" + name_.text();
    info_.note = backend == HidBackend::kHidraw ? "hidraw" : "libusb";
  }
  ~HidPort() override { close(); }

  [[nodiscard]] Expected<std::size_t, Disconnected> read(
      std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience) override {
    const auto wait =
        std::chrono::ceil<std::chrono::milliseconds>(std::max(patience, decltype(patience){0}));
    const int count =
        hidapi_.read_timeout(device_, bytes.data(), bytes.size(), static_cast<int>(wait.count()));
    if (count < 0) return Unexpected<Disconnected>(Disconnected{});
    return static_cast<std::size_t>(count);
  }

  [[nodiscard]] Expected<void, Disconnected> write(std::span<const std::uint8_t> bytes) override {
    if (bytes.empty()) return {};
    if (hidapi_.write(device_, bytes.data(), bytes.size()) < 0) {
      return Unexpected<Disconnected>(Disconnected{});
    }
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    close();
    std::string path;
    hid_device_info* const list = hidapi_.enumerate(name_.vendor, name_.product);
    for (const hid_device_info* entry = list; entry != nullptr; entry = entry->next) {
      const std::string serial_number = narrow(entry->serial_number);
      if (!name_.serial_number.empty() && serial_number != name_.serial_number) continue;
      path = entry->path;
      info_.serial_number = serial_number;
      break;
    }
    hidapi_.free_enumeration(list);
    if (path.empty()) return Unexpected<SetupError>(port_error(info_.name, ENODEV));
    // Read before opening: libusb detaches the kernel's driver.
    info_.report_descriptor = report_descriptor_of(path);
    errno = 0;
    device_ = hidapi_.open_path(path.c_str());
    if (device_ == nullptr) {
      const bool node = path.starts_with('/');
      const int error_number =
          node && ::access(path.c_str(), R_OK | W_OK) == 0 ? EIO : (node ? errno : EACCES);
      return Unexpected<SetupError>(port_error(path, error_number));
    }
    // After a replug, only the same device may be opened.
    name_.serial_number = info_.serial_number;
    return {};
  }

 private:
  void close() noexcept {
    if (device_ != nullptr) hidapi_.close(std::exchange(device_, nullptr));
  }

  Hidapi hidapi_;
  UsbName name_;
  hid_device* device_ = nullptr;
};

}  // namespace

Expected<std::unique_ptr<Transport>, SetupError> open_hid_port(const UsbName& name,
                                                               HidBackend backend) {
  const auto hidapi = Hidapi::load(backend);
  if (!hidapi) return Unexpected<SetupError>(hidapi.error());
  return opened<HidPort>(*hidapi, name, backend);
}

}  // namespace merkel
