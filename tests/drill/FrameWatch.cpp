#include "tests/drill/FrameWatch.h"

#include "common/application/Application.h"

namespace tessera::drill {

using namespace std::chrono_literals;

FrameWatch::FrameWatch(const std::string& address)
    : thread_([this, address](const std::stop_token& stop) { watch(stop, address); }) {}

FrameWatch::~FrameWatch() {
    thread_.request_stop();
    seen_.close();
}

void FrameWatch::watch(const std::stop_token& stop, const std::string& address) {
    while (!stop.stop_requested()) {
        // It dials again itself, more often than applications do.
        auto application = Application::connect(
            {.address = address, .name = "drill", .followScene = false, .timeout = 2s, .redial = 0ms});
        if (!application) {
            std::this_thread::sleep_for(20ms);  // a server that is being started again
            continue;
        }
        const auto told = (*application)->onFrame([&](const notice::Frame& frame) {
            seen_.tryPush(SeenFrame{.at = std::chrono::steady_clock::now(), .hosts = frame.shown});
        });
        bool connected = told.has_value();
        while (connected && !stop.stop_requested()) connected = (*application)->poll(100ms).has_value();
        if (!stop.stop_requested()) seen_.tryPush(Lost{std::chrono::steady_clock::now()});
    }
}

}  // namespace tessera::drill
