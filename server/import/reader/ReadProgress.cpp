#include "server/import/reader/ReadProgress.h"

#include <chrono>

namespace tessera {
namespace {

using Clock = std::chrono::steady_clock;

void (*listening)(std::uint64_t, std::uint64_t, bool) = nullptr;
Clock::time_point next;
bool isConverting = false;

}  // namespace

void sayProgress(std::uint64_t done, std::uint64_t total) {
    if (listening == nullptr || total == 0) return;
    const Clock::time_point now = Clock::now();
    if (now < next) return;
    next = now + std::chrono::milliseconds(100);
    isConverting = false;
    listening(done, total, false);
}

void sayConverting(std::uint64_t done, std::uint64_t total) {
    if (listening == nullptr) return;
    const Clock::time_point now = Clock::now();
    if (isConverting && (total == 0 || now < next)) return;
    next = now + std::chrono::milliseconds(100);
    isConverting = true;
    listening(done, total, true);
}

void listenToProgress(void (*listener)(std::uint64_t, std::uint64_t, bool)) {
    listening = listener;
}

}  // namespace tessera
