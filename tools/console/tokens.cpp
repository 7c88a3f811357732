#include "tools/console/tokens.hpp"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "tools/console/private_file.hpp"

namespace punctum::console {
namespace {

bool is_token(std::string_view token) {
  return token.size() >= Tokens::kLeast && token.size() <= Tokens::kMost &&
         std::all_of(token.begin(), token.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                  c == '_';
         });
}

// Takes the same time wherever they differ.
bool is_same_token(std::string_view a, std::string_view b) {
  unsigned differing = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    differing |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  }
  return differing == 0;
}

}  // namespace

tl::expected<Tokens, std::string> Tokens::read(const std::string& path) {
  const auto text = read_file(path, Readers::owner);
  if (!text) {
    return tl::unexpected(text.error());
  }
  Tokens tokens;
  std::istringstream lines(*text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line.substr(0, line.find('#')));
    std::string role, token, who, more;
    words >> role >> token >> who >> more;
    if (role.empty()) {
      continue;
    }
    if ((role != "view" && role != "operate") || !is_token(token) || !more.empty()) {
      return tl::unexpected(fmt::format(
          "{}:{}: allowed: view|operate TOKEN [NAME], where TOKEN has {} to {} letters, digits, - "
          "or _ (openssl rand -hex 32 makes one)",
          path, number, kLeast, kMost));
    }
    if (std::any_of(tokens.all_.begin(), tokens.all_.end(),
                    [&token](const One& one) { return is_same_token(one.token, token); })) {
      return tl::unexpected(fmt::format("{}:{}: this token stands in the file twice", path, number));
    }
    tokens.all_.push_back({token,
                           {role == "operate" ? Role::operate : Role::view,
                            who.empty() ? fmt::format("{} {}", role, tokens.all_.size() + 1) : who}});
  }
  if (tokens.all_.empty()) {
    return tl::unexpected(path + ": it holds no token");
  }
  return tokens;
}

tl::expected<Tokens, std::string> Tokens::make() {
  std::array<unsigned char, 32> random{};
  if (getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size())) {
    return tl::unexpected(std::string("the system gives no random numbers"));
  }
  Tokens tokens;
  for (const unsigned char byte : random) {
    tokens.made_ += fmt::format("{:02x}", byte);
  }
  tokens.all_.push_back({tokens.made_, {Role::operate, "operator"}});
  return tokens;
}

tl::expected<Person, std::string> Tokens::person(std::string_view token) const {
  const One* found = nullptr;
  for (const One& one : all_) {  // all of them, always
    found = is_same_token(one.token, token) ? &one : found;
  }
  if (found != nullptr) {
    return found->person;
  }
  if (token.empty() && !made_.empty()) {
    return Person{Role::view, "visitor"};
  }
  return tl::unexpected(std::string(token.empty() ? "a token is needed" : "this token is not known"));
}

}  // namespace punctum::console
