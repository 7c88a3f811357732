// libgpiod 1 (Debian 12).
#include <fcntl.h>
#include <gpiod.h>

#include <array>
#include <cstring>

#include "hal/gpiod/lines.hpp"
#include "hal/kernel_call.hpp"

namespace punctum::gpiod {
namespace {

constexpr unsigned kAtOnce = 16;  // as many as the kernel keeps of a line

class LineV1 final : public Line {
 public:
  explicit LineV1(gpiod_line* line) : line_(line), descriptor_(gpiod_line_event_get_fd(line)) {}
  ~LineV1() override { gpiod_line_release(line_); }

  [[nodiscard]] hal::Status read(bool& active) NONBLOCKING override {
    const hal::Answer answer = hal::kernel_call<gpiod_line_get_value>(line_);
    if (answer.value < 0) {
      return status_of(answer.error);
    }
    active = answer.value != 0;
    return hal::Status::ok;
  }
  [[nodiscard]] hal::Status write(bool active) NONBLOCKING override {
    const hal::Answer answer = hal::kernel_call<gpiod_line_set_value>(line_, active ? 1 : 0);
    return answer.value < 0 ? status_of(answer.error) : hal::Status::ok;
  }
  [[nodiscard]] hal::Status take_changes(int& changes) NONBLOCKING override {
    const hal::Answer answer =
        hal::kernel_call<gpiod_line_event_read_fd_multiple>(descriptor_, events_.data(), kAtOnce);
    changes = answer.value > 0 ? answer.value : 0;
    return answer.value < 0 && answer.error != EAGAIN ? status_of(answer.error) : hal::Status::ok;
  }

 private:
  gpiod_line* line_;
  int descriptor_;
  std::array<gpiod_line_event, kAtOnce> events_{};
};

int flags_of(const LineRequest& request) {
  int flags = request.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  if (request.bias == Bias::pull_up) {
    flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
  } else if (request.bias == Bias::pull_down) {
    flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
  }
  return flags;
}

int type_of(Use use) {
  switch (use) {
    case Use::input:
      return GPIOD_LINE_REQUEST_DIRECTION_INPUT;
    case Use::watched_input:
      return GPIOD_LINE_REQUEST_EVENT_BOTH_EDGES;
    case Use::output:
    case Use::held_output:
      break;
  }
  return GPIOD_LINE_REQUEST_DIRECTION_OUTPUT;
}

std::string words(const char* text) { return text == nullptr ? "" : text; }

class ChipV1 final : public Chip {
 public:
  explicit ChipV1(gpiod_chip* chip) : chip_(chip) {}
  ~ChipV1() override { gpiod_chip_close(chip_); }

  [[nodiscard]] unsigned line_count() const override { return gpiod_chip_num_lines(chip_); }
  [[nodiscard]] std::string label() const override { return gpiod_chip_label(chip_); }
  [[nodiscard]] LineFacts facts(unsigned offset) const override {
    gpiod_line* line = gpiod_chip_get_line(chip_, offset);
    return line == nullptr ? LineFacts{}
                           : LineFacts{words(gpiod_line_name(line)), gpiod_line_is_used(line),
                                       words(gpiod_line_consumer(line))};
  }
  [[nodiscard]] tl::expected<std::unique_ptr<Line>, std::string> claim(const LineRequest& request) override {
    gpiod_line* line = gpiod_chip_get_line(chip_, request.offset);
    const gpiod_line_request_config config{"punctum", type_of(request.use), flags_of(request)};
    if (line == nullptr || gpiod_line_request(line, &config, request.use == Use::held_output ? 1 : 0) != 0) {
      return tl::unexpected(std::string(std::strerror(errno)));
    }
    auto claimed = std::make_unique<LineV1>(line);
    if (request.use == Use::watched_input && fcntl(gpiod_line_event_get_fd(line), F_SETFL, O_NONBLOCK) != 0) {
      return tl::unexpected(std::string(std::strerror(errno)));
    }
    return claimed;
  }

 private:
  gpiod_chip* chip_;
};

}  // namespace

tl::expected<std::unique_ptr<Chip>, std::string> open_chip(const std::string& path) {
  gpiod_chip* chip = gpiod_chip_open(path.c_str());
  if (chip == nullptr) {
    return tl::unexpected(std::string(std::strerror(errno)));
  }
  return std::make_unique<ChipV1>(chip);
}

}  // namespace punctum::gpiod
