#include "cli/interrupt.h"

#include <csignal>

#include <atomic>

namespace polestar::cli {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};

// A signal handler has no other way to its context.
std::atomic<Context*> interruptedContext{nullptr};
static_assert(std::atomic<Context*>::is_always_lock_free);

void cancelContext(int) {
  if (Context* context = interruptedContext.load()) context->cancel();
}

}  // namespace

InterruptGuard::InterruptGuard(Context& context) {
  interruptedContext.store(&context);
  for (const int signal : kSignals) {
    struct sigaction current {};
    // nohup and background jobs ignore signals on purpose.
    if (sigaction(signal, nullptr, &current) != 0 || current.sa_handler == SIG_IGN) continue;
    struct sigaction action {};
    action.sa_handler = cancelContext;
    // No SA_RESTART: a read that waits for standard input has to come back.
    action.sa_flags = SA_RESETHAND;
    sigaction(signal, &action, nullptr);
  }
}

InterruptGuard::~InterruptGuard() {
  for (const int signal : kSignals) {
    struct sigaction current {};
    if (sigaction(signal, nullptr, &current) == 0 && current.sa_handler == cancelContext)
      std::signal(signal, SIG_DFL);
  }
  interruptedContext.store(nullptr);
}

}  // namespace polestar::cli
