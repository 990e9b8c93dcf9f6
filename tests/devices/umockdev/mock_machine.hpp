#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include <umockdev.h>

namespace merkel {

using Bytes = std::vector<std::uint8_t>;

/// What answers the system calls on a device node. Its functions run on umockdev's thread; false
/// leaves the call to the file that stands for the node.
class NodeHandler {
 public:
  NodeHandler() = default;
  NodeHandler(const NodeHandler&) = delete;
  NodeHandler& operator=(const NodeHandler&) = delete;
  virtual ~NodeHandler() = default;

  virtual bool handle_ioctl(UMockdevIoctlClient* client) = 0;
  virtual bool handle_read(UMockdevIoctlClient* /*client*/) { return false; }
  virtual bool handle_write(UMockdevIoctlClient* /*client*/) { return false; }
};

/// Which handler a node has; none once the device is gone.
struct NodeAttachment {
  std::string node;
  std::mutex mutex;
  NodeHandler* handler = nullptr;
};

/// A machine whose /sys, /dev and udev are umockdev's: what runs in this process, and in its
/// children, sees the devices that are plugged in here and no others.
class MockMachine {
 public:
  MockMachine();
  MockMachine(const MockMachine&) = delete;
  MockMachine& operator=(const MockMachine&) = delete;
  ~MockMachine();

  /// Adds devices in umockdev's notation, a parent before what is below it.
  void add(const std::string& devices);
  /// Removes a device and what is below it, and tells who listens.
  void unplug(const std::string& sys_path);
  /// Tells who listens by udev.
  void announce(const std::string& sys_path, const std::string& action);
  void attach(const std::string& node, NodeHandler& handler);
  void detach(const std::string& node);

  /// One that no device has had: umockdev keeps those of devices that are gone.
  [[nodiscard]] std::string fresh_number() { return std::to_string(++numbers_); }

  /// Where a node of /dev really is.
  [[nodiscard]] std::string place_of(const std::string& node) const;
  /// Puts a packet pipe in a node's place. Returns its descriptor, which the caller closes.
  int make_pipe(const std::string& node);
  /// The other end of a terminal. The machine closes it.
  [[nodiscard]] int terminal_of(const std::string& node);
  /// Sets a node's rights, as chmod does, and its group, to dialout where we may.
  void set_rights(const std::string& node, unsigned mode) const;

 private:
  UMockdevTestbed* testbed_;
  int numbers_ = 0;
  std::deque<NodeAttachment> attachments_;
  std::vector<std::string> plugged_;  ///< paths in /sys
};

/// As long as it lives, this thread has the rights of nobody: root may open everything.
class Unprivileged {
 public:
  Unprivileged();
  Unprivileged(const Unprivileged&) = delete;
  Unprivileged& operator=(const Unprivileged&) = delete;
  ~Unprivileged();
};

/// "1B2C", for descriptors in umockdev's notation.
[[nodiscard]] std::string hexadecimal(const Bytes& bytes);

}  // namespace merkel
