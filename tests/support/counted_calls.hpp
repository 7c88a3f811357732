// How often the processor enters the functions of a program: at the start of each stands a breakpoint.
#pragma once

#include <elf.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ptrace.h>
#include <sys/uio.h>
#include <sys/user.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace punctum::tests {

using Calls = std::map<std::string, int>;

// By name without arguments: every overload and every clone that is called, as offsets from the program's
// start.
inline std::map<std::uint64_t, std::string> starts_of(const std::string& program,
                                                      const std::vector<std::string>& names) {
  const auto close = [](std::FILE* f) { pclose(f); };
  const std::unique_ptr<std::FILE, decltype(close)> pipe(
      popen(("nm -C --defined-only '" + program + "'").c_str(), "r"), close);
  std::map<std::uint64_t, std::string> starts;
  std::array<char, 4096> line{};
  while (pipe != nullptr && std::fgets(line.data(), line.size(), pipe.get()) != nullptr) {
    const std::string text = line.data();
    if (text.size() < 20 || std::string("tTwW").find(text[17]) == std::string::npos ||
        text.find("[clone .cold") != std::string::npos) {
      continue;
    }
    for (const std::string& name : names) {
      if (text.compare(19, name.size() + 1, name + "(") == 0) {
        starts[std::strtoull(text.c_str(), nullptr, 16)] = name;
      }
    }
  }
  return starts;
}

// Runs `program`, one thread, to its end with its output in `log`. A name that it does not define is a
// failure.
inline Calls counted_calls(const std::string& program, const std::vector<std::string>& args,
                           const std::string& log, const std::vector<std::string>& names) {
#ifdef __aarch64__
  constexpr std::uint64_t kBreak = 0xd4200000, kBits = 0xffffffff;
  constexpr auto kCounter = &user_regs_struct::pc;
  constexpr std::uint64_t kPassed = 0;  // the counter stands on the breakpoint
#else
  constexpr std::uint64_t kBreak = 0xcc, kBits = 0xff;
  constexpr auto kCounter = &user_regs_struct::rip;
  constexpr std::uint64_t kPassed = 1;  // behind it
#endif
  Calls calls;
  const auto starts = starts_of(program, names);
  for (const auto& [start, name] : starts) {
    calls[name] = 0;
  }
  for (const std::string& name : names) {
    EXPECT_TRUE(calls.contains(name)) << program << " has no function " << name;
  }
  const pid_t pid = fork();
  if (pid == 0) {
    const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(out, 1);
    dup2(out, 2);
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const auto& a : args) {
      argv.push_back(const_cast<char*>(a.c_str()));
    }
    argv.push_back(nullptr);
    ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
    execv(program.c_str(), argv.data());
    _exit(127);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  if (!WIFSTOPPED(status)) {
    ADD_FAILURE() << program << " could not be watched";
    return calls;
  }
  ptrace(PTRACE_SETOPTIONS, pid, nullptr, PTRACE_O_EXITKILL);
  // The first mapping is the program's own: position-independent, it begins at its offset 0.
  std::uint64_t base = 0;
  std::ifstream("/proc/" + std::to_string(pid) + "/maps") >> std::hex >> base;

  std::map<std::uint64_t, std::uint64_t> words;  // as they were
  const auto put = [pid](std::uint64_t at, std::uint64_t word) {
    EXPECT_EQ(ptrace(PTRACE_POKETEXT, pid, at, word), 0);
  };
  for (const auto& [start, name] : starts) {
    const std::uint64_t at = base + start;
    words[at] = static_cast<std::uint64_t>(ptrace(PTRACE_PEEKTEXT, pid, at, nullptr));
    put(at, (words[at] & ~kBits) | kBreak);
  }
  int signal = 0;
  for (;;) {
    ptrace(PTRACE_CONT, pid, nullptr, signal);
    waitpid(pid, &status, 0);
    if (!WIFSTOPPED(status)) {
      break;
    }
    signal = WSTOPSIG(status);
    user_regs_struct registers{};
    iovec where{&registers, sizeof registers};
    ptrace(PTRACE_GETREGSET, pid, NT_PRSTATUS, &where);
    const auto hit = words.find(registers.*kCounter - kPassed);
    if (signal != SIGTRAP || hit == words.end()) {
      continue;
    }
    // One instruction without the breakpoint.
    ++calls[starts.at(hit->first - base)];
    registers.*kCounter = hit->first;
    ptrace(PTRACE_SETREGSET, pid, NT_PRSTATUS, &where);
    put(hit->first, hit->second);
    ptrace(PTRACE_SINGLESTEP, pid, nullptr, nullptr);
    waitpid(pid, &status, 0);
    put(hit->first, (hit->second & ~kBits) | kBreak);
    signal = 0;
  }
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << program << " ended with status " << status;
  return calls;
}

}  // namespace punctum::tests
