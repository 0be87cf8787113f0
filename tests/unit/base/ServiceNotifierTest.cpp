/// What a service manager hears of a program, at a socket as systemd has it.
#include "common/base/ServiceNotifier.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <string>

#include "common/base/FileHandle.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

/// Where the manager would listen.
class Listener {
public:
    explicit Listener(const std::string& name)
        : file_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::memcpy(address.sun_path, name.data(), name.size());
        if (name[0] == '@') address.sun_path[0] = '\0';
        if (name[0] == '/') path_ = name;
        ::unlink(path_.c_str());
        const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
        EXPECT_EQ(::bind(file_.get(), reinterpret_cast<const sockaddr*>(&address), length), 0);
        ::setenv("NOTIFY_SOCKET", name.c_str(), 1);
    }
    ~Listener() {
        if (!path_.empty()) ::unlink(path_.c_str());
    }
    Listener(const Listener&) = delete;
    /// The next datagram; empty: there is none.
    std::string next() {
        std::array<char, 4096> some{};
        const ssize_t got = ::recv(file_.get(), some.data(), some.size(), 0);
        return got > 0 ? std::string(some.data(), static_cast<std::size_t>(got)) : "";
    }

private:
    FileHandle file_;
    std::string path_;
};

std::string freshName(const std::string& what) {
    return "@tessera-test-" + what + "-" + std::to_string(::getpid());
}

constexpr TimePoint kFirstTurn = TimePoint(1000s);
const auto kNothingNew = [] { return std::string(); };

TEST(ServiceNotifier, SaysWhatItIsToldAtAPathAndAtAnAbstractName) {
    for (const std::string& name :
         {freshName("says"), testing::TempDir() + "/tessera-notify-" + std::to_string(::getpid())}) {
        Listener listener(name);
        ServiceNotifier notifier = ServiceNotifier::ofThisProcess();
        ASSERT_TRUE(notifier.isThere()) << name;
        notifier.ready();
        EXPECT_EQ(listener.next(), "READY=1\nWATCHDOG=1\n");
        notifier.status("loads\nhall.tsct\nREADY=1");
        EXPECT_EQ(listener.next(), "STATUS=loads hall.tsct READY=1\n");
        notifier.status("loads\nhall.tsct\nREADY=1");
        EXPECT_EQ(listener.next(), "") << "the same status twice";
        notifier.stopping();
        EXPECT_EQ(listener.next(), "STOPPING=1\n");
    }
}

TEST(ServiceNotifier, ChildrenDoNotSpeakForIt) {
    Listener listener(freshName("children"));
    ::setenv("WATCHDOG_USEC", "30000000", 1);
    ::setenv("WATCHDOG_PID", std::to_string(::getpid()).c_str(), 1);
    (void)ServiceNotifier::ofThisProcess();
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) EXPECT_EQ(std::getenv(name), nullptr);
}

TEST(ServiceNotifier, FeedsTheWatchdogThreeTimesInItsTimeAndOnlyWhileTheWorkGoesOn) {
    Listener listener(freshName("feeds"));
    ::setenv("WATCHDOG_USEC", "30000000", 1);
    ServiceNotifier notifier = ServiceNotifier::ofThisProcess();
    int fed = 0;
    for (Duration at = 0s; at < 30s; at += 10ms) {
        notifier.turned(kFirstTurn + at, true, kNothingNew);
        fed += listener.next() == "WATCHDOG=1\n";
    }
    EXPECT_EQ(fed, 3);
    // What was done since it was fed last counts once; then it starves.
    fed = 0;
    for (Duration at = 30s; at < 90s; at += 10ms) {
        notifier.turned(kFirstTurn + at, false, kNothingNew);
        fed += listener.next() == "WATCHDOG=1\n";
    }
    EXPECT_EQ(fed, 1);
    notifier.turned(kFirstTurn + 90s, true, kNothingNew);
    EXPECT_EQ(listener.next(), "WATCHDOG=1\n");
}

TEST(ServiceNotifier, DescribesItselfNowAndThen) {
    Listener listener(freshName("describes"));
    ServiceNotifier notifier = ServiceNotifier::ofThisProcess();
    int asked = 0;
    for (Duration at = 0s; at < 10s; at += 10ms)
        notifier.turned(kFirstTurn + at, true, [&] { return "frame " + std::to_string(++asked); });
    EXPECT_EQ(asked, 5);
    EXPECT_EQ(listener.next(), "STATUS=frame 1\n") << "without WATCHDOG_USEC no watchdog is fed";
}

TEST(ServiceNotifier, AWatchdogOfAnotherProcessIsNotFed) {
    for (const auto& [usec, pid] :
         {std::pair("30000000", "1"), std::pair("30000000", "x"), std::pair("soon", ""), std::pair("", ""),
          std::pair("-1", ""), std::pair("0", ""), std::pair("99999999999999999999", "")}) {
        Listener listener(freshName("other"));
        ::setenv("WATCHDOG_USEC", usec, 1);
        ::setenv("WATCHDOG_PID", pid, 1);
        ServiceNotifier notifier = ServiceNotifier::ofThisProcess();
        notifier.turned(kFirstTurn, true, kNothingNew);
        EXPECT_EQ(listener.next(), "") << usec << " " << pid;
    }
}

TEST(ServiceNotifier, WithoutASocketNothingIsSaidOrAsked) {
    const std::string tooLong = "/" + std::string(200, 'x');
    for (const std::string& name : {std::string(), std::string("@"), std::string("vsock:2:1"), tooLong}) {
        ::setenv("NOTIFY_SOCKET", name.c_str(), 1);
        ServiceNotifier notifier = ServiceNotifier::ofThisProcess();
        EXPECT_FALSE(notifier.isThere()) << name;
        notifier.ready();
        notifier.turned(kFirstTurn, true, [&] { return ADD_FAILURE() << name, std::string(); });
    }
    // Nobody listens (any more).
    ::setenv("NOTIFY_SOCKET", "/nonexistent/notify", 1);
    ServiceNotifier::ofThisProcess().ready();
}

TEST(PaceOfFrames, IsWhatHasComeSinceItWasAskedBefore) {
    PaceOfFrames pace;
    EXPECT_EQ(pace.text(kFirstTurn), "no frame yet");
    pace.shown(1000);  // a journal goes on with it
    EXPECT_EQ(pace.text(kFirstTurn + 2s), "frame 1000");
    pace.shown(1120);
    EXPECT_EQ(pace.text(kFirstTurn + 4s), "frame 1120, 60 a second");
    pace.shown(20);  // of a server that begins anew
    EXPECT_EQ(pace.text(kFirstTurn + 6s), "frame 20, 0 a second");
}

}  // namespace
}  // namespace tessera
