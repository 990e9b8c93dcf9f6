#include "tests/devices/umockdev/mock_machine.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <utility>

#include <fcntl.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace merkel {
namespace {

constexpr unsigned kNobody = 65534;
constexpr int kPipeBytes = 1 << 16;

using Answer = bool (NodeHandler::*)(UMockdevIoctlClient*);

/// Lets the handler answer, if the device is still plugged in.
template <Answer answer>
gboolean on_call(UMockdevIoctlBase* /*base*/, UMockdevIoctlClient* client, gpointer data) {
  auto& attachment = *static_cast<NodeAttachment*>(data);
  const std::scoped_lock lock(attachment.mutex);
  if (attachment.handler != nullptr) return (attachment.handler->*answer)(client) ? TRUE : FALSE;
  umockdev_ioctl_client_complete(client, -1, ENODEV);
  return TRUE;
}

template <Answer answer>
void connect(UMockdevIoctlBase* base, const char* signal, NodeAttachment& attachment) {
  g_signal_connect_data(base, signal, reinterpret_cast<GCallback>(on_call<answer>), &attachment,
                        nullptr, GConnectFlags{});
}

}  // namespace

MockMachine::MockMachine() : testbed_(umockdev_testbed_new()) {
  // The folder is private to its owner, but an unprivileged thread uses it too.
  ::chmod(place_of("").c_str(), 0777);
}

MockMachine::~MockMachine() { g_object_unref(testbed_); }

void MockMachine::add(const std::string& devices) {
  GError* error = nullptr;
  umockdev_testbed_add_from_string(testbed_, devices.c_str(), &error);
  EXPECT_EQ(error, nullptr) << error->message;
  std::istringstream lines(devices);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("P: ")) plugged_.push_back("/sys" + line.substr(3));
  }
}

void MockMachine::unplug(const std::string& sys_path) {
  announce(sys_path, "remove");
  // umockdev removes the links to a device, but not those to its children.
  std::vector<std::string> all;
  for (const std::string& path : plugged_) {
    if (path.starts_with(sys_path)) all.push_back(path);
  }
  std::erase_if(plugged_, [&](const std::string& path) { return path.starts_with(sys_path); });
  std::for_each(all.rbegin(), all.rend(), [&](const std::string& path) {
    umockdev_testbed_remove_device(testbed_, path.c_str());
  });
}

void MockMachine::announce(const std::string& sys_path, const std::string& action) {
  umockdev_testbed_uevent(testbed_, sys_path.c_str(), action.c_str());
}

void MockMachine::attach(const std::string& node, NodeHandler& handler) {
  // Programs that have the node open keep calling after the unplug.
  NodeAttachment& attachment = attachments_.emplace_back();
  attachment.node = node;
  attachment.handler = &handler;
  UMockdevIoctlBase* const base = umockdev_ioctl_base_new();
  connect<&NodeHandler::handle_ioctl>(base, "handle-ioctl", attachment);
  connect<&NodeHandler::handle_read>(base, "handle-read", attachment);
  connect<&NodeHandler::handle_write>(base, "handle-write", attachment);
  GError* error = nullptr;
  umockdev_testbed_attach_ioctl(testbed_, node.c_str(), base, &error);
  EXPECT_EQ(error, nullptr) << error->message;
  g_object_unref(base);
  ::chmod(place_of("/ioctl" + node).c_str(), 0777);
}

void MockMachine::detach(const std::string& node) {
  for (NodeAttachment& attachment : attachments_) {
    if (attachment.node != node) continue;
    const std::scoped_lock lock(attachment.mutex);
    if (std::exchange(attachment.handler, nullptr) != nullptr) {
      umockdev_testbed_detach_ioctl(testbed_, node.c_str(), nullptr);
    }
  }
}

std::string MockMachine::place_of(const std::string& node) const {
  gchar* const root = umockdev_testbed_get_root_dir(testbed_);
  const std::string place = root + node;
  g_free(root);
  return place;
}

int MockMachine::make_pipe(const std::string& node) {
  const std::string place = place_of(node);
  std::filesystem::remove(place);
  std::filesystem::create_directories(std::filesystem::path(place).parent_path());
  EXPECT_EQ(::mkfifo(place.c_str(), 0600), 0);
  set_rights(node, 0666);
  const int descriptor = ::open(place.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  // Packet mode: one write is one read. A named pipe can only be set to it after opening.
  EXPECT_EQ(::fcntl(descriptor, F_SETFL, O_NONBLOCK | O_DIRECT), 0);
  ::fcntl(descriptor, F_SETPIPE_SZ, kPipeBytes);
  return descriptor;
}

int MockMachine::terminal_of(const std::string& node) {
  return umockdev_testbed_get_dev_fd(testbed_, node.c_str());
}

void MockMachine::set_rights(const std::string& node, unsigned mode) const {
  const std::string place = place_of(node);
  EXPECT_EQ(::chmod(place.c_str(), mode), 0);
  const group* const dialout = ::getgrnam("dialout");
  if (::geteuid() == 0 && dialout != nullptr) {
    EXPECT_EQ(::chown(place.c_str(), 0, dialout->gr_gid), 0);
  }
}

Unprivileged::Unprivileged() {
  // The system call, because the C library's function changes all threads.
  if (::geteuid() == 0) {
    EXPECT_EQ(::syscall(SYS_setresuid, kNobody, kNobody, 0), 0);
  }
}

Unprivileged::~Unprivileged() { static_cast<void>(::syscall(SYS_setresuid, 0, 0, 0)); }

std::string hexadecimal(const Bytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02X", byte);
    text += digits.data();
  }
  return text;
}

}  // namespace merkel
