#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include <umockdev.h>

namespace merkel {

using Bytes = std::vector<std::uint8_t>;

/// Answers the system calls on a device node. Its functions run on umockdev's thread; false leaves
/// the call to the file behind the node.
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

/// The handler of a node; none after the unplug.
struct NodeAttachment {
  std::string node;
  std::mutex mutex;
  NodeHandler* handler = nullptr;
};

/// A machine with umockdev's /sys, /dev and udev. This process and its children see only the
/// devices that are plugged in here.
class MockMachine {
 public:
  MockMachine();
  MockMachine(const MockMachine&) = delete;
  MockMachine& operator=(const MockMachine&) = delete;
  ~MockMachine();

  /// Adds devices in umockdev's notation, parents before their children.
  void add(const std::string& devices);
  /// Removes a device and its children, and notifies udev listeners.
  void unplug(const std::string& sys_path);
  /// Notifies udev listeners.
  void announce(const std::string& sys_path, const std::string& action);
  void attach(const std::string& node, NodeHandler& handler);
  void detach(const std::string& node);

  /// An unused number: umockdev keeps the numbers of removed devices.
  [[nodiscard]] std::string fresh_number() { return std::to_string(++numbers_); }

  /// The real path of a node of /dev.
  [[nodiscard]] std::string place_of(const std::string& node) const;
  /// Replaces a node by a packet pipe. Returns its descriptor, which the caller closes.
  int make_pipe(const std::string& node);
  /// The other end of a terminal. The machine closes it.
  [[nodiscard]] int terminal_of(const std::string& node);
  /// Sets a node's rights like chmod, and its group to dialout if permitted.
  void set_rights(const std::string& node, unsigned mode) const;

 private:
  UMockdevTestbed* testbed_;
  int numbers_ = 0;
  std::deque<NodeAttachment> attachments_;
  std::vector<std::string> plugged_;  ///< paths in /sys
};

/// During its lifetime this thread is unprivileged, because root may open everything.
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
