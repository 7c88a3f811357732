// What a client sends to punctum-console, text and binary: a message of the protocol, or one line.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "tests/fuzz/must.hpp"
#include "tools/console/client_message.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace punctum::console;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  for (const auto& message : {read_text(bytes), read_binary(bytes)}) {
    if (!message) {
      must(!message.error().empty() && message.error().find('\n') == std::string::npos,
           "a refusal of no line or of several");
    } else if (const auto* wanted = std::get_if<Subscribe>(&*message)) {
      must(wanted->subscriptions.size() <= kMostSubscriptions, "more subscriptions than one client may have");
    } else if (const auto* call = std::get_if<ServiceCall>(&*message)) {
      must(13 + call->encoding.size() + call->request.size() == size, "bytes of a call came from nowhere");
    }
  }
  return 0;
}
