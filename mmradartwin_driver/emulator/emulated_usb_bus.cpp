#include "emulated_usb_bus.h"

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <umockdev.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

namespace mmradartwin {
namespace {

/// Device, configuration, and four vendor-specific interfaces with a bulk endpoint of 512 bytes each way.
std::string descriptors() {
  std::string text =
      "12010002000000405104"
      "03fd0008000000010902"
      "65000401008032";
  for (int port = 0; port < 4; ++port) {
    char interface[64];
    std::snprintf(interface, sizeof interface, "0904%02x0002ffffff000705%02x020002000705%02x02000200", port,
                  0x81 + 2 * port, 0x02 + 2 * port);
    text += interface;
  }
  return text;
}

}  // namespace

struct EmulatedUsbBus::State {
  explicit State(EmulatedFtdi& c) : chip(c) {}

  EmulatedFtdi& chip;
  UMockdevTestbed* testbed = nullptr;
  UMockdevIoctlBase* handler = nullptr;
  std::string node, device;
  std::string pulled;  ///< node of the device before
  int number = 0;
  std::atomic<bool> gone{true}, busy{false};
  std::atomic<int> transfers_left{-1};
  std::deque<UMockdevIoctlData*> finished;  // only the bus's thread
  std::mutex calls;                         // held during each

  static gboolean onIoctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, State* self) {
    const std::lock_guard<std::mutex> lock(self->calls);
    return self->handle(client);
  }

  gboolean handle(UMockdevIoctlClient* client) {
    UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(client);
    switch (umockdev_ioctl_client_get_request(client)) {
      case USBDEVFS_GET_CAPABILITIES: {
        UMockdevIoctlData* flags = umockdev_ioctl_data_resolve(argument, 0, sizeof(guint32), nullptr);
        const guint32 value = USBDEVFS_CAP_BULK_SCATTER_GATHER | USBDEVFS_CAP_BULK_CONTINUATION |
                              USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT |
                              USBDEVFS_CAP_ZERO_PACKET;
        std::memcpy(flags->data, &value, sizeof value);
        umockdev_ioctl_data_unref(flags);
        umockdev_ioctl_client_complete(client, 0, 0);
        return TRUE;
      }
      case USBDEVFS_CLAIMINTERFACE:
        if (gone || busy) {
          umockdev_ioctl_client_complete(client, -1, gone ? ENODEV : EBUSY);
        } else {
          umockdev_ioctl_client_complete(client, 0, 0);
        }
        return TRUE;
      case USBDEVFS_RELEASEINTERFACE:
      case USBDEVFS_CLEAR_HALT:
      case USBDEVFS_RESET:
      case USBDEVFS_RESETEP:
        umockdev_ioctl_client_complete(client, 0, 0);
        return TRUE;
      case USBDEVFS_SUBMITURB:
        submit(client, argument);
        return TRUE;
      case USBDEVFS_REAPURB:
      case USBDEVFS_REAPURBNDELAY:
        reap(client, argument);
        return TRUE;
      case USBDEVFS_DISCARDURB:
        // Every transfer is finished as soon as it is submitted, and will be reaped.
        umockdev_ioctl_client_complete(client, -1, EINVAL);
        return TRUE;
      default:
        return FALSE;
    }
  }

  void submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    if (transfers_left > 0 && --transfers_left == 0) gone = true;
    if (gone) {
      umockdev_ioctl_client_complete(client, -1, ENODEV);
      return;
    }
    UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
    auto* urb = reinterpret_cast<usbdevfs_urb*>(data->data);
    UMockdevIoctlData* buffer = umockdev_ioctl_data_resolve(data, offsetof(usbdevfs_urb, buffer),
                                                            static_cast<gsize>(urb->buffer_length), nullptr);
    const auto* bytes = buffer ? buffer->data : nullptr;
    const auto size = static_cast<std::size_t>(urb->buffer_length);
    urb->status = 0;
    urb->actual_length = 0;
    if (urb->type == USBDEVFS_URB_TYPE_CONTROL && size >= 8) {
      const bool vendor_out = bytes[0] == 0x40;
      if (!vendor_out || !chip.vendorRequest(bytes[1], bytes[2] | bytes[3] << 8, bytes[4] | bytes[5] << 8)) {
        urb->status = -EPIPE;
      }
    } else if (urb->type == USBDEVFS_URB_TYPE_BULK && (urb->endpoint & 0x80)) {
      const std::vector<std::uint8_t> answer = chip.read(((urb->endpoint & 0x7F) - 1) / 2, size);
      std::copy(answer.begin(), answer.end(), buffer->data);
      urb->actual_length = static_cast<int>(answer.size());
      // The latency timer's time, after which the chip sends its status without data.
      if (answer.size() <= 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    } else if (urb->type == USBDEVFS_URB_TYPE_BULK) {
      chip.write((urb->endpoint - 2) / 2, std::vector<std::uint8_t>(bytes, bytes + size));
      urb->actual_length = urb->buffer_length;
    } else {
      urb->status = -EPIPE;
    }
    if (buffer) umockdev_ioctl_data_unref(buffer);
    finished.push_back(data);
    umockdev_ioctl_client_complete(client, 0, 0);
  }

  void reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    if (finished.empty()) {
      umockdev_ioctl_client_complete(client, -1, gone ? ENODEV : EAGAIN);
      return;
    }
    UMockdevIoctlData* data = finished.front();
    finished.pop_front();
    UMockdevIoctlData* pointer = umockdev_ioctl_data_resolve(argument, 0, sizeof(gpointer), nullptr);
    umockdev_ioctl_data_set_ptr(pointer, 0, data);
    umockdev_ioctl_client_complete(client, 0, 0);
    umockdev_ioctl_data_unref(pointer);
    umockdev_ioctl_data_unref(data);
  }
};

EmulatedUsbBus::EmulatedUsbBus(EmulatedFtdi& chip) : state_(std::make_unique<State>(chip)) {
  state_->testbed = umockdev_testbed_new();
  if (!state_->testbed) throw std::runtime_error("umockdev has no testbed");
  state_->handler = umockdev_ioctl_base_new();
  g_signal_connect_after(state_->handler, "handle-ioctl", G_CALLBACK(&State::onIoctl), state_.get());
}

EmulatedUsbBus::~EmulatedUsbBus() {
  unplug();
  g_object_unref(state_->handler);
  g_object_unref(state_->testbed);
  // The bus's thread has ended, by glib's locks alone; this one shows it to the thread sanitizer, too.
  { const std::lock_guard<std::mutex> lock(state_->calls); }
  for (UMockdevIoctlData* data : state_->finished) umockdev_ioctl_data_unref(data);
}

bool EmulatedUsbBus::available() {
  // What is asked for shows only while there is a testbed.
  UMockdevTestbed* const testbed = umockdev_testbed_new();
  if (!testbed) return false;
  const bool mocked = umockdev_in_mock_environment();
  g_object_unref(testbed);
  return mocked;
}

std::string EmulatedUsbBus::root() const {
  gchar* const path = umockdev_testbed_get_root_dir(state_->testbed);
  const std::string root = path;
  g_free(path);
  return root;
}

void EmulatedUsbBus::plug() {
  State& state = *state_;
  if (!state.gone) return;
  unplug();
  if (!state.pulled.empty()) umockdev_testbed_detach_ioctl(state.testbed, state.pulled.c_str(), nullptr);
  state.pulled.clear();
  ++state.number;
  char text[128];
  std::snprintf(text, sizeof text, "/dev/bus/usb/001/%03d", state.number);
  state.node = text;
  state.device = "/devices/usb1/1-" + std::to_string(state.number);
  state.gone = false;
  state.transfers_left = -1;
  if (!umockdev_testbed_attach_ioctl(state.testbed, state.node.c_str(), state.handler, nullptr)) {
    throw std::runtime_error("umockdev cannot attach to " + state.node);
  }
  const std::string number = std::to_string(state.number);
  const std::string description =
      "P: " + state.device + "\nN: " + state.node.substr(5) +
      "\nE: SUBSYSTEM=usb\nE: DRIVER=usb\nE: BUSNUM=001\nE: DEVNUM=" + state.node.substr(17) +
      "\nE: DEVNAME=" + state.node +
      "\nE: DEVTYPE=usb_device\nA: idVendor=0451\\n\nA: idProduct=fd03\\n\nA: bConfigurationValue=1\\n\nA: "
      "busnum=1\\n\nA: devnum=" +
      number + "\\n\nA: speed=480\\n\nH: descriptors=" + descriptors() + "\n";
  GError* error = nullptr;
  if (!umockdev_testbed_add_from_string(state.testbed, description.c_str(), &error)) {
    const std::string why = error ? error->message : "";
    if (error) g_error_free(error);
    throw std::runtime_error("umockdev does not take the device: " + why);
  }
}

void EmulatedUsbBus::unplug() {
  State& state = *state_;
  state.gone = true;
  if (state.node.empty()) return;
  // Only this process and those that run under the same library hear of it.
  if (umockdev_in_mock_environment()) {
    umockdev_testbed_uevent(state.testbed, ("/sys" + state.device).c_str(), "remove");
  }
  umockdev_testbed_remove_device(state.testbed, ("/sys" + state.device).c_str());
  // Who still holds the device open asks on, and is told that it is gone, until another is plugged in.
  state.pulled = state.node;
  state.node.clear();
}

void EmulatedUsbBus::unplugAfter(int transfers) { state_->transfers_left = transfers; }

void EmulatedUsbBus::setBusy(bool busy) { state_->busy = busy; }

}  // namespace mmradartwin
