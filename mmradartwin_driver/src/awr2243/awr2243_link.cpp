#include "awr2243/awr2243_link.h"

#include "mmradartwin_driver/mpsse_spi.h"
#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

Awr2243Link::Awr2243Link(const Awr2243Registers& registers, const std::string& image_file,
                         Awr2243Control::EventSink events)
    : Awr2243Link(registers, image_file, std::move(events), Awr2243Control::Options(),
                  [] { return std::make_unique<UsbDevice>(); }) {}

Awr2243Link::Awr2243Link(const Awr2243Registers& registers, const std::string& image_file,
                         Awr2243Control::EventSink events, const Awr2243Control::Options& options, OpenUsb open_usb)
    : registers_(registers),
      image_file_(image_file),
      events_(std::move(events)),
      options_(options),
      open_usb_(std::move(open_usb)) {
  if (!image_file_.empty()) image_ = loadFirmwareImage(image_file_);
}

Awr2243Link::~Awr2243Link() {
  try {
    stop();
  } catch (const RigError&) {
    // The radar is gone: nothing to stop.
  }
}

void Awr2243Link::drop() {
  running_ = false;
  version_.clear();
  control_.reset();
  port_.reset();
  usb_.reset();
}

template <class Action>
void Awr2243Link::guarded(Action action) {
  try {
    action();
  } catch (const RigError&) {
    drop();
    throw;
  } catch (const InputError& error) {  // an error that only the device shows, such as missing firmware
    drop();
    throw RigError(error.what());
  }
}

void Awr2243Link::prepare() {
  if (control_) return;
  guarded([this] {
    usb_ = open_usb_();
    port_ = std::make_unique<FtdiRadarPort>(*usb_);
    control_ = std::make_unique<Awr2243Control>(*port_, events_, options_);
    control_->bringUp(registers_, image_, image_file_);
    version_ = control_->version().text();
  });
}

void Awr2243Link::start() {
  prepare();
  stop();
  guarded([this] { control_->start(); });
  running_ = true;
}

void Awr2243Link::stop() {
  if (!running_) return;
  running_ = false;
  guarded([this] { control_->stop(); });
}

void Awr2243Link::poll() {
  if (!control_) return;
  guarded([this] {
    control_->poll();
    if (!control_->fault().empty()) throw RigError("radar: " + control_->fault() + "; it is brought up again");
  });
}

std::optional<int> Awr2243Link::temperature_deg_c() const {
  return control_ ? control_->temperature_deg_c() : std::nullopt;
}

}  // namespace mmradartwin
