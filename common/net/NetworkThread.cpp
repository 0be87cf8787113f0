#include "common/net/NetworkThread.h"

#include "common/net/TcpTransport.h"

namespace tessera {

namespace asio = boost::asio;

void NetworkThread::start(std::function<void()> first) {
    thread_ = std::thread([this, first = std::move(first)] {
        if (first) first();
        runInside();
    });
}

void NetworkThread::join() {
    closing_ = true;
    absence_.left(kAtOnce);
    thread_.join();
}

void NetworkThread::runInside() {
    for (;; absence_.wait()) {
        const Turn::Hold hold = turn_.take();
        if (!closing_ && !busy() && now() < attendantLeft_ + TcpTransport::kAbsence) continue;
        while (!wanted_ && !io_.stopped()) io_.run_one();
        if (io_.stopped()) return;
    }
}

bool NetworkThread::attend(TimePoint until) {
    if (busy()) return false;
    if (until <= now()) {
        glance();
        return true;
    }
    if (delivered_.exchange(false) || woken_.exchange(false)) return true;
    if (const Turn::Hold hold = turn_.tryTake(); hold) {
        runHere(until);
    } else {
        wanted_ = true;
        asio::post(io_, [] {});  // the thread inside may wait in the reactor
        const Turn::Hold waitedFor = turn_.take();
        wanted_ = false;
        runHere(until);
    }
    return true;
}

void NetworkThread::wake() {
    if (!woken_.exchange(true)) asio::post(io_, [] {});
}

/// Does what is ready, and not for long: who calls has something else to do.
void NetworkThread::glance() {
    constexpr int kMostHandlers = 64;
    if (const Turn::Hold hold = turn_.tryTake(); hold) {
        absence_.back();
        for (int count = 0; count < kMostHandlers && io_.poll_one() > 0; ++count) {
        }
        attendantLeft_ = now();
        absence_.left(busy() ? kAtOnce : TcpTransport::kAbsence);
    }
}

void NetworkThread::runHere(TimePoint until) {
    absence_.back();
    while (!delivered_.exchange(false) && !woken_.exchange(false) && !busy() && now() < until) {
        wakeAt(until);
        io_.run_one();
    }
    attendantLeft_ = now();
    absence_.left(busy() ? kAtOnce : TcpTransport::kAbsence);
}

bool NetworkThread::isRecent(Duration large) {
    return large != Duration::zero() && now().time_since_epoch() < large + TcpTransport::kQuiet;
}

/// An alarm that comes too early stays: who is woken by it looks at the clock and asks again.
void NetworkThread::wakeAt(TimePoint until) {
    if (alarmAt_ <= until) return;
    alarmAt_ = until;
    alarm_.expires_at(until);
    alarm_.async_wait([this](const boost::system::error_code& error) {
        if (!error) alarmAt_ = TimePoint::max();
    });
}

}  // namespace tessera
