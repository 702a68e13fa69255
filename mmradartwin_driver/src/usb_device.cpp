#include "mmradartwin_driver/usb_device.h"

#include <libusb.h>

#include "mmradartwin_driver/rig_error.h"

namespace mmradartwin {
namespace {

constexpr int kInterfaces = 4;
constexpr unsigned kWriteTimeout_ms = 2000;
constexpr std::uint8_t kVendorOut = LIBUSB_REQUEST_TYPE_VENDOR | LIBUSB_RECIPIENT_DEVICE | LIBUSB_ENDPOINT_OUT;
constexpr int kTransferBytes = 4096;

/// Interfaces A to D have the endpoints 0x81/0x02, 0x83/0x04, 0x85/0x06, 0x87/0x08.
unsigned char endpointIn(int interface) { return static_cast<unsigned char>(0x81 + 2 * interface); }
unsigned char endpointOut(int interface) { return static_cast<unsigned char>(0x02 + 2 * interface); }

[[noreturn]] void fail(int error, const std::string& action) { throw RigError(describeUsbError(error, action)); }

}  // namespace

struct UsbDevice::Handles {
  libusb_context* context = nullptr;
  libusb_device_handle* device = nullptr;
  int claimed = 0;

  ~Handles() {
    for (int interface = 0; interface < claimed; ++interface) libusb_release_interface(device, interface);
    if (device) libusb_close(device);
    if (context) libusb_exit(context);
  }
};

std::string describeUsbError(int error, const std::string& action) {
  const std::string what = "USB 0451:fd03 (RADAR_FTDI): " + action + ": ";
  switch (error) {
    case LIBUSB_ERROR_ACCESS:
      return what +
             "no permission; install the udev rule (sudo cp $(rospack find mmradartwin_driver)/udev/"
             "70-mmradartwin.rules /etc/udev/rules.d/ && sudo udevadm control --reload && sudo udevadm trigger), be in "
             "the group plugdev, and plug the cable in again";
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return what + "the device is gone; plug the cable in J1 (RADAR_FTDI) of the DCA1000 in again, check its power";
    case LIBUSB_ERROR_BUSY:
      return what + "another program or kernel driver holds it; end that program, or unload it (sudo rmmod ftdi_sio)";
    case LIBUSB_ERROR_TIMEOUT:
      return what + "the chip does not answer; plug the cable in J1 in again";
    default:
      return what + libusb_strerror(error) + "; plug the cable in J1 in again";
  }
}

UsbDevice::UsbDevice() : handles_(std::make_unique<Handles>()) {
  if (const int error = libusb_init(&handles_->context)) fail(error, "start libusb");
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(handles_->context, &list);
  if (count < 0) fail(static_cast<int>(count), "list devices");
  libusb_device* found = nullptr;
  int matches = 0;
  for (ssize_t i = 0; i < count; ++i) {
    libusb_device_descriptor descriptor;
    if (libusb_get_device_descriptor(list[i], &descriptor) != 0) continue;
    if (descriptor.idVendor != kRadarUsbVendor || descriptor.idProduct != kRadarUsbProduct) continue;
    found = list[i];
    ++matches;
  }
  int error = 0;
  if (matches == 1) {
    error = libusb_open(found, &handles_->device);
    const int size = libusb_get_max_packet_size(found, endpointIn(0));
    if (size > 2) packet_bytes_ = static_cast<std::size_t>(size);
  }
  libusb_free_device_list(list, 1);
  if (matches == 0) {
    throw RigError(
        "the radar's USB port (0451:fd03) is not there: plug the cable into J1 (RADAR_FTDI) of the DCA1000, not into "
        "J4, and switch the card's power on");
  }
  if (matches > 1) {
    throw RigError(std::to_string(matches) + " devices 0451:fd03 are plugged in: leave one of the capture cards");
  }
  if (error) fail(error, "open");
  for (int interface = 0; interface < kInterfaces; ++interface) {
    if ((error = libusb_claim_interface(handles_->device, interface))) {
      fail(error, "claim interface " + std::to_string(interface));
    }
    handles_->claimed = interface + 1;
  }
}

UsbDevice::~UsbDevice() = default;

void UsbDevice::vendorRequest(std::uint8_t request, std::uint16_t value, std::uint16_t index) {
  const int result =
      libusb_control_transfer(handles_->device, kVendorOut, request, value, index, nullptr, 0, kWriteTimeout_ms);
  if (result < 0) fail(result, "vendor request " + std::to_string(request));
}

void UsbDevice::write(int interface, const std::vector<std::uint8_t>& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    int sent = 0;
    const int result =
        libusb_bulk_transfer(handles_->device, endpointOut(interface), const_cast<unsigned char*>(bytes.data() + done),
                             static_cast<int>(bytes.size() - done), &sent, kWriteTimeout_ms);
    done += static_cast<std::size_t>(sent);
    if (result != 0) fail(result, "write to interface " + std::to_string(interface));
  }
}

std::vector<std::uint8_t> UsbDevice::read(int interface, std::chrono::milliseconds timeout) {
  std::vector<std::uint8_t> bytes(kTransferBytes);
  int received = 0;
  // libusb waits without limit for a time-out of 0.
  const auto limit = static_cast<unsigned>(timeout.count() > 0 ? timeout.count() : 1);
  const int result =
      libusb_bulk_transfer(handles_->device, endpointIn(interface), bytes.data(), kTransferBytes, &received, limit);
  if (result != 0 && result != LIBUSB_ERROR_TIMEOUT) fail(result, "read from interface " + std::to_string(interface));
  bytes.resize(static_cast<std::size_t>(received));
  return bytes;
}

}  // namespace mmradartwin
