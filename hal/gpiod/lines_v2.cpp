// libgpiod 2 (Debian 13).
#include <fcntl.h>
#include <gpiod.h>

#include <cstring>

#include "hal/gpiod/lines.hpp"
#include "hal/kernel_call.hpp"

namespace punctum::gpiod {
namespace {

constexpr std::size_t kAtOnce = 16;  // as many as the kernel keeps of a line

template <auto Free>
struct Freed {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};
using Request = std::unique_ptr<gpiod_line_request, Freed<gpiod_line_request_release>>;
using Events = std::unique_ptr<gpiod_edge_event_buffer, Freed<gpiod_edge_event_buffer_free>>;

class LineV2 final : public Line {
 public:
  LineV2(Request request, Events events, unsigned offset)
      : request_(std::move(request)), events_(std::move(events)), offset_(offset) {}

  [[nodiscard]] hal::Status read(bool& active) NONBLOCKING override {
    const hal::Answer answer = hal::kernel_call<gpiod_line_request_get_value>(request_.get(), offset_);
    if (answer.value < 0) {
      return status_of(answer.error);
    }
    active = answer.value == GPIOD_LINE_VALUE_ACTIVE;
    return hal::Status::ok;
  }
  [[nodiscard]] hal::Status write(bool active) NONBLOCKING override {
    const hal::Answer answer = hal::kernel_call<gpiod_line_request_set_value>(
        request_.get(), offset_, active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE);
    return answer.value < 0 ? status_of(answer.error) : hal::Status::ok;
  }
  [[nodiscard]] hal::Status take_changes(int& changes) NONBLOCKING override {
    const hal::Answer answer =
        hal::kernel_call<gpiod_line_request_read_edge_events>(request_.get(), events_.get(), kAtOnce);
    changes = answer.value > 0 ? answer.value : 0;
    return answer.value < 0 && answer.error != EAGAIN ? status_of(answer.error) : hal::Status::ok;
  }

 private:
  Request request_;
  Events events_;
  unsigned offset_;
};

std::string words(const char* text) { return text == nullptr ? "" : text; }

class ChipV2 final : public Chip {
 public:
  explicit ChipV2(gpiod_chip* chip) : chip_(chip) {}
  ~ChipV2() override { gpiod_chip_close(chip_); }

  [[nodiscard]] unsigned line_count() const override {
    const std::unique_ptr<gpiod_chip_info, Freed<gpiod_chip_info_free>> info(gpiod_chip_get_info(chip_));
    return info ? static_cast<unsigned>(gpiod_chip_info_get_num_lines(info.get())) : 0;
  }
  [[nodiscard]] std::string label() const override {
    const std::unique_ptr<gpiod_chip_info, Freed<gpiod_chip_info_free>> info(gpiod_chip_get_info(chip_));
    return info ? words(gpiod_chip_info_get_label(info.get())) : "";
  }
  [[nodiscard]] LineFacts facts(unsigned offset) const override {
    const std::unique_ptr<gpiod_line_info, Freed<gpiod_line_info_free>> info(
        gpiod_chip_get_line_info(chip_, offset));
    return info ? LineFacts{words(gpiod_line_info_get_name(info.get())), gpiod_line_info_is_used(info.get()),
                            words(gpiod_line_info_get_consumer(info.get()))}
                : LineFacts{};
  }
  [[nodiscard]] tl::expected<std::unique_ptr<Line>, std::string> claim(const LineRequest& wanted) override {
    const std::unique_ptr<gpiod_line_settings, Freed<gpiod_line_settings_free>> settings(
        gpiod_line_settings_new());
    const std::unique_ptr<gpiod_line_config, Freed<gpiod_line_config_free>> lines(gpiod_line_config_new());
    const std::unique_ptr<gpiod_request_config, Freed<gpiod_request_config_free>> config(
        gpiod_request_config_new());
    Events events(wanted.use == Use::watched_input ? gpiod_edge_event_buffer_new(kAtOnce) : nullptr);
    if (!settings || !lines || !config || (wanted.use == Use::watched_input && !events)) {
      return tl::unexpected(std::string(std::strerror(ENOMEM)));
    }
    gpiod_request_config_set_consumer(config.get(), "punctum");
    gpiod_request_config_set_event_buffer_size(config.get(), kAtOnce);
    gpiod_line_settings_set_active_low(settings.get(), wanted.active_low);
    gpiod_line_settings_set_output_value(
        settings.get(), wanted.use == Use::held_output ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE);
    const bool set = gpiod_line_settings_set_direction(
                         settings.get(), is_output(wanted.use) ? GPIOD_LINE_DIRECTION_OUTPUT
                                                               : GPIOD_LINE_DIRECTION_INPUT) == 0 &&
                     gpiod_line_settings_set_edge_detection(
                         settings.get(), wanted.use == Use::watched_input ? GPIOD_LINE_EDGE_BOTH
                                                                          : GPIOD_LINE_EDGE_NONE) == 0 &&
                     gpiod_line_settings_set_bias(settings.get(), bias_of(wanted.bias)) == 0 &&
                     gpiod_line_config_add_line_settings(lines.get(), &wanted.offset, 1, settings.get()) == 0;
    Request request(set ? gpiod_chip_request_lines(chip_, config.get(), lines.get()) : nullptr);
    if (!request || (events && fcntl(gpiod_line_request_get_fd(request.get()), F_SETFL, O_NONBLOCK) != 0)) {
      return tl::unexpected(std::string(std::strerror(errno)));
    }
    return std::make_unique<LineV2>(std::move(request), std::move(events), wanted.offset);
  }

 private:
  static gpiod_line_bias bias_of(Bias bias) {
    return bias == Bias::pull_up     ? GPIOD_LINE_BIAS_PULL_UP
           : bias == Bias::pull_down ? GPIOD_LINE_BIAS_PULL_DOWN
                                     : GPIOD_LINE_BIAS_AS_IS;
  }

  gpiod_chip* chip_;
};

}  // namespace

tl::expected<std::unique_ptr<Chip>, std::string> open_chip(const std::string& path) {
  gpiod_chip* chip = gpiod_chip_open(path.c_str());
  if (chip == nullptr) {
    return tl::unexpected(std::string(std::strerror(errno)));
  }
  return std::make_unique<ChipV2>(chip);
}

}  // namespace punctum::gpiod
