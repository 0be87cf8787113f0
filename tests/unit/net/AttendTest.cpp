/// A caller that waits does the network's work: what it sees is what everybody sees.
#include <gtest/gtest.h>

#include <future>
#include <random>
#include <thread>

#include "Peers.h"
#include "common/net/AbsenceTimer.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using link_event::Closed;
using link_event::Opened;
using link_event::Received;
using test::eventually;
using test::pattern;
using test::Peer;

TimePoint now() {
    return std::chrono::steady_clock::now();
}

/// Waits as the frame loop and a host's session thread do.
class Attendant {
public:
    Attendant() {
        TransportLimits limits;
        limits.maxPayload = [](std::uint16_t) { return std::size_t{64} << 20; };
        transport_ = std::make_unique<TcpTransport>(limits, [this](LinkEvent event) {
            const bool here = std::this_thread::get_id() == me_;
            // Of messages and ends; that bytes come is told as often as they do.
            if (!std::holds_alternative<link_event::Heard>(event.what)) ++(here ? deliveredHere_ : deliveredInside_);
            events_.push(std::move(event));
        });
    }
    Transport* operator->() { return transport_.get(); }

    std::optional<LinkEvent> next(Duration wait) {
        std::optional<LinkEvent> event = events_.tryPop();
        if (event) return event;
        return transport_->attend(now() + wait) ? events_.tryPop() : events_.popFor(wait);
    }
    template <typename What>
    What next() {
        for (const TimePoint end = now() + test::kPatience; now() < end;) {
            auto event = next(100ms);
            if (event && std::holds_alternative<What>(event->what)) return std::get<What>(event->what);
        }
        ADD_FAILURE() << "an expected event did not come";
        return {};
    }
    [[nodiscard]] int deliveredHere() const { return deliveredHere_; }
    [[nodiscard]] int deliveredInside() const { return deliveredInside_; }

private:
    std::thread::id me_ = std::this_thread::get_id();
    std::atomic<int> deliveredHere_{0}, deliveredInside_{0};
    Channel<LinkEvent> events_{1 << 16};
    std::unique_ptr<TcpTransport> transport_;
};

TEST(Attend, WhoWaitsIsTheNetworkThread) {
    Peer server;
    Attendant client;
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    client.next<Opened>();
    const LinkId accepted = server.next<Opened>().link;
    const int before = client.deliveredHere();
    int atOnce = 0;
    for (std::uint16_t i = 1; i <= 20; ++i) {
        client->send(link, i, 1_epoch, share(pattern(i)));
        atOnce += client->queuedBytes(link) == 0 ? 1 : 0;
        EXPECT_EQ(server.next<Received>().type, i);
        server->send(accepted, i, 1_epoch, share(pattern(i)));
        EXPECT_EQ(client.next<Received>().type, i);
    }
    // Not all where the machine stands still for longer than an attendant may be away.
    EXPECT_GT(client.deliveredHere(), before + 5);
    EXPECT_GT(atOnce, 5) << "what is sent is on its way, and nobody was woken for it";
}

TEST(Attend, TheThreadInsideTakesOverFromOneThatIsAway) {
    Peer server;
    Attendant client;
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    client.next<Opened>();
    const LinkId accepted = server.next<Opened>().link;
    for (int round = 0; round < 3; ++round) {
        (void)client->attend(now() + 1ms);
        const int before = client.deliveredInside();
        server->send(accepted, 1, 1_epoch, share(pattern(10)));
        EXPECT_TRUE(eventually([&] { return client.deliveredInside() > before; }, test::kPatience));
        EXPECT_EQ(client.deliveredInside(), before + 1) << round;
        client->send(link, 2, 1_epoch, share(pattern(20)));
        EXPECT_EQ(server.next<Received>().type, 2);
        EXPECT_EQ(client.next<Received>().type, 1);
    }
}

TEST(Attend, EndsInTimeAndWhenWoken) {
    Attendant idle;
    const TimePoint began = now();
    EXPECT_TRUE(idle->attend(began + 20ms));
    EXPECT_GE(now(), began + 20ms);
    EXPECT_TRUE(idle->attend(began)) << "a time that is over";
    idle->wake();
    EXPECT_TRUE(idle->attend(now() + 10min)) << "woken before";
    std::thread other([&] {
        std::mt19937 random(1);
        for (int i = 0; i < 100; ++i) {
            test::aMoment(random, 200us);
            idle->wake();
        }
    });
    EXPECT_TRUE(idle->attend(now() + 10min));
    other.join();
    EXPECT_TRUE(idle->attend(now() + 10min)) << "woken since";
    EXPECT_TRUE(idle->attend(now() + 30ms)) << "an earlier end than that of the call before";
    idle->end();
    idle->wake();
}

TEST(Attend, OrderStaysWhoeverWrites) {
    Peer server;
    Attendant client;
    std::mt19937 random(7);
    const auto below = [&](unsigned n) { return std::uniform_int_distribution<unsigned>(0, n - 1)(random); };
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    constexpr std::uint16_t kMessages = 3000;
    std::thread reader([&] {
        for (std::uint16_t i = 0; i < kMessages; ++i) {
            const Received frame = server.next<Received>();
            ASSERT_EQ(frame.epoch, Epoch(i));
            if (i % 16 == 0) server->send(frame.link, 1, frame.epoch, frame.payload);
        }
    });
    for (std::uint16_t i = 0; i < kMessages; ++i) {
        const bool large = below(100) == 0;
        client->send(link, 1, Epoch(i), share(pattern(large ? 1 << 20 : below(200))));
        if (below(20) == 0) (void)client.next(Duration(below(2'000'000)));
        if (below(100) == 0) test::aMoment(random, 12ms);
    }
    reader.join();
    // The reader may have the last one before the thread that has written it notes that it is gone.
    const TimePoint read = now();
    while (client->queuedBytes(link) > 0 && now() < read + test::kPatience) std::this_thread::yield();
    EXPECT_EQ(client->queuedBytes(link), 0u);
}

TEST(Attend, AGlanceReadsWhatIsThereWithoutWaiting) {
    Peer server;
    Attendant client;
    client->connect({"127.0.0.1", server.listen()}, 5s);
    client.next<Opened>();
    const LinkId accepted = server.next<Opened>().link;
    const int here = client.deliveredHere();
    // On a loaded machine this thread may be the one that is away for too long, now and then.
    for (int round = 0; round < 100 && client.deliveredHere() == here; ++round) {
        // What has come is forgotten by the first, and the second is the network thread.
        for (int i = 0; i < 2; ++i) (void)client->attend(now() + 1ms);
        const int before = client.deliveredInside() + client.deliveredHere();
        server->send(accepted, 1, 1_epoch, share(pattern(10)));
        const TimePoint begun = now();
        while (client.deliveredInside() + client.deliveredHere() == before && now() < begun + test::kPatience)
            EXPECT_TRUE(client->attend(now()));
    }
    EXPECT_GT(client.deliveredHere(), here);
}

TEST(Attend, LargeMessagesAreLeftToTheThreadInside) {
    Peer server;
    Attendant client;
    const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
    client.next<Opened>();
    const LinkId accepted = server.next<Opened>().link;
    const SharedBytes big = share(pattern(20u << 20));
    client->send(link, 1, 1_epoch, big);
    EXPECT_FALSE(client->attend(now() + 10min));
    EXPECT_TRUE(server.next<Received>().payload == *big);
    EXPECT_TRUE(eventually([&] { return client->attend(now() + 1ms); })) << "nothing large has come for a while";
    server->send(accepted, 1, 1_epoch, big);
    const int before = client.deliveredInside();
    EXPECT_TRUE(client.next<Received>().payload == *big);
    EXPECT_EQ(client.deliveredInside(), before + 1);
}

TEST(Attend, EndsWhileTheAttendantIsAwayAndSendsWhatIsQueued) {
    Peer server;
    {
        Attendant client;
        const LinkId link = client->connect({"127.0.0.1", server.listen()}, 5s);
        client.next<Opened>();
        client->send(link, 3, 1_epoch, share(pattern(100)));
        client->send(link, 4, 1_epoch, share(pattern(5u << 20)));
        client->send(link, 5, 1_epoch, share(pattern(100)));
    }
    for (std::uint16_t type = 3; type <= 5; ++type) EXPECT_EQ(server.next<Received>().type, type);
    server.next<Closed>();
}

TEST(AbsenceTimer, WakesOnlyWhenTheTimeIsOver) {
    AbsenceTimer timer;
    std::future<TimePoint> woken = std::async(std::launch::async, [&] {
        timer.wait();
        return now();
    });
    timer.left(5ms);
    timer.back();
    EXPECT_EQ(woken.wait_for(30ms), std::future_status::timeout);
    const TimePoint left = now();
    timer.left(10ms);
    EXPECT_GE(woken.get(), left + 10ms);
}

}  // namespace
}  // namespace tessera
