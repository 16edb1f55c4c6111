#ifndef HEDDLE_TESTS_PIPELINE_PROGRAM_H_
#define HEDDLE_TESTS_PIPELINE_PROGRAM_H_
// Runs the built program as a user would, and kills it as a farm would.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace heddle {

inline std::string text_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

struct ProgramResult {
  int status = -1;  // exit status; -signal where a signal ended the program
  std::string out;
  std::string error;
};

/// A started program; standard output and error go to files in `folder`.
class Program {
 public:
  /// `prepare` runs in the new process before the program does: limits, ignored signals, other
  /// standard streams.
  Program(const std::filesystem::path& folder, std::vector<std::string> arguments,
          const std::string& input = "", const std::function<void()>& prepare = {})
      : out_(folder / "stdout.txt"), error_(folder / "stderr.txt") {
    const std::filesystem::path in = folder / "stdin.txt";
    std::ofstream(in) << input;
    arguments.insert(arguments.begin(), HEDDLE_PROGRAM);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ == 0) {
      redirect(in, O_RDONLY, STDIN_FILENO);
      redirect(out_, O_WRONLY | O_CREAT | O_TRUNC, STDOUT_FILENO);
      redirect(error_, O_WRONLY | O_CREAT | O_TRUNC, STDERR_FILENO);
      if (prepare) prepare();
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
  }

  /// Waits until `condition` holds, then sends the signal. False where the program ended before.
  bool signal_when(const std::function<bool()>& condition, int signal_number) {
    for (;;) {
      if (condition()) {
        ::kill(pid_, signal_number);
        return true;
      }
      int status = 0;
      if (::waitpid(pid_, &status, WNOHANG) == pid_) {
        ended_ = true;
        wait_status_ = status;
        return false;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  /// Has it come as far as to answer SIGTERM, which it then blocks in all threads but one?
  /// (Libraries that start threads block all signals for a moment.)
  bool answers_signals() const {
    std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
    for (std::string name; status >> name;) {
      unsigned long blocked = 0;
      if (name != "SigBlk:" || !(status >> std::hex >> blocked)) continue;
      const auto blocks = [blocked](int signal_number) {
        return (blocked >> (signal_number - 1) & 1) != 0;
      };
      return blocks(SIGTERM) && !blocks(SIGHUP);
    }
    return false;
  }

  ProgramResult wait() {
    if (!ended_) ::waitpid(pid_, &wait_status_, 0);
    ended_ = true;
    const int status =
        WIFEXITED(wait_status_) ? WEXITSTATUS(wait_status_) : -WTERMSIG(wait_status_);
    return {status, text_of(out_), text_of(error_)};
  }

 private:
  static void redirect(const std::filesystem::path& file, int flags, int descriptor) {
    const int opened = ::open(file.c_str(), flags, 0644);
    if (opened < 0 || ::dup2(opened, descriptor) < 0) ::_exit(126);
  }
  std::filesystem::path out_;
  std::filesystem::path error_;
  pid_t pid_ = -1;
  bool ended_ = false;
  int wait_status_ = 0;
};

}  // namespace heddle

#endif  // HEDDLE_TESTS_PIPELINE_PROGRAM_H_
