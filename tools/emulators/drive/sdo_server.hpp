// The SDO server of a CANopen device (CiA 301): expedited and segmented transfers both ways. Block transfers
// are refused with the abort code for a command that the server does not know.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "tools/emulators/drive/object_dictionary.hpp"

namespace punctum::emulator {

class SdoServer {
 public:
  using Message = std::array<std::uint8_t, 8>;
  using Hook = std::function<void(std::uint16_t index, std::uint8_t sub)>;

  SdoServer(ObjectDictionary& objects, Hook before_read, Hook after_write)
      : objects_(objects), before_read_(std::move(before_read)), after_write_(std::move(after_write)) {}

  // What is answered to a client's message, if anything.
  [[nodiscard]] std::optional<Message> answer(const Message& request);
  void reset() { transfer_ = Transfer::none; }

 private:
  enum class Transfer : std::uint8_t { none, upload, download };

  [[nodiscard]] Message abort(std::uint32_t code);
  [[nodiscard]] Message start_download(const Message& request);
  [[nodiscard]] Message download_segment(const Message& request);
  [[nodiscard]] Message start_upload();
  [[nodiscard]] Message upload_segment(const Message& request);
  [[nodiscard]] Abort write(std::uint32_t raw, int bytes);

  ObjectDictionary& objects_;
  Hook before_read_, after_write_;

  Transfer transfer_ = Transfer::none;  // that goes on, segment by segment
  std::uint16_t index_ = 0;             // of the last transfer that was begun
  std::uint8_t sub_ = 0;
  bool toggle_ = false;
  std::string bytes_;  // what is sent, or has come
  std::size_t sent_ = 0;
  std::uint32_t announced_ = 0;  // bytes of a download; 0: not said
};

}  // namespace punctum::emulator
