/// How many requests of one name may be open at once, where their answers are large. The door's thread alone.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

namespace tessera {

/// What an answer takes is known once it is there: of each name it is remembered. Until a first answer has come, and
/// where one was large, the next ones of that name wait; of many sockets that ask for tens of megabytes each, all would
/// lie here at once.
///
/// Of those who wait the one goes first who will have had the fewest bytes, if the next answer is as large as the last
/// one: fair queueing (Demers, Keshav, Shenker, SIGCOMM 1989) with what is known before an answer is made. Who comes
/// begins where an even share of all that was told would have brought him. So who asks for little, or for the first
/// time, waits for one answer, however many others have asked for much; those of whom nothing is known yet take turns.
/// Nobody waits for ever. Of equals the one goes first who went longest ago.
class AnswerLanes {
public:
    static constexpr std::size_t kLarge = std::size_t{1} << 20, kAtOnce = 2;

    explicit AnswerLanes(boost::asio::io_context& io) : io_(io) {}

    /// Held as long as the request is open.
    class Ticket {
    public:
        Ticket(AnswerLanes& lanes, std::string name, const void* who)
            : lanes_(lanes), name_(std::move(name)), who_(who) {
            ++lanes_.lanes_[name_].open;
        }
        ~Ticket() { lanes_.left(name_); }
        Ticket(const Ticket&) = delete;
        Ticket& operator=(const Ticket&) = delete;
        void answered(std::size_t bytes) const {
            Lane& lane = lanes_.lanes_[name_];
            lane.most = std::max(bytes, lane.most - lane.most / 8);  // after some small ones it is wide again
            lane.answered = true;
            lane.now += bytes / lane.waiting();
            if (const auto known = lane.clients.find(who_); known != lane.clients.end()) {
                known->second.had += bytes;
                known->second.last = bytes;
            }
        }

    private:
        AnswerLanes& lanes_;
        const std::string name_;
        const void* const who_;
    };

    using Ask = std::function<void(std::shared_ptr<const Ticket>)>;
    /// Calls `ask` now, or later: with what has to live until the answer is there.
    void enter(const void* who, const std::string& name, Ask ask) {
        Lane& lane = lanes_[name];
        if (lane.narrow()) {
            Client& client = lane.clients[who];
            if (client.waiting.empty()) client.had = std::max(client.had, lane.now);
            if (client.turn == 0) client.turn = ++lane.turns;
            if (lane.open >= kAtOnce) return client.waiting.push_back(std::move(ask));
        }
        ask(std::make_shared<const Ticket>(*this, name, who));
    }
    /// What waits of this one is forgotten.
    void leave(const void* who) {
        for (auto& [name, lane] : lanes_) lane.clients.erase(who);
    }
    /// Nobody is called any more.
    void close() {
        closed_ = true;
        for (auto& [name, lane] : lanes_) lane.clients.clear();
    }

private:
    struct Client {
        std::uint64_t had = 0;   ///< bytes of answers, and its share of what others had before it came
        std::uint64_t last = 0;  ///< bytes of the last answer
        std::uint64_t turn = 0;  ///< when it went last, or came
        [[nodiscard]] auto order() const { return std::pair(had + last, turn); }
        std::deque<Ask> waiting = {};
    };
    struct Lane {
        std::size_t open = 0, most = 0;
        bool answered = false;
        std::uint64_t now = 0;    ///< what one who always waits would have had
        std::uint64_t turns = 0;  ///< so far
        std::map<const void*, Client> clients = {};
        /// The next one's turn; null: nobody waits.
        [[nodiscard]] std::pair<const void* const, Client>* next() {
            std::pair<const void* const, Client>* least = nullptr;
            for (auto& client : clients)
                if (!client.second.waiting.empty() && (!least || client.second.order() < least->second.order()))
                    least = &client;
            return least;
        }
        /// How many share; at least one.
        [[nodiscard]] std::uint64_t waiting() const {
            const auto waits = [](const auto& client) { return !client.second.waiting.empty(); };
            return static_cast<std::uint64_t>(std::max<std::ptrdiff_t>(1, std::ranges::count_if(clients, waits)));
        }
        [[nodiscard]] bool narrow() const { return !answered || most > kLarge; }
    };
    void left(const std::string& name) {
        --lanes_[name].open;
        if (closed_) return;
        // Not from here: one that is refused at once would let go of the next from within.
        boost::asio::post(io_, [this, name] {
            Lane& lane = lanes_[name];
            while (!closed_ && (!lane.narrow() || lane.open < kAtOnce)) {
                auto* const next = lane.next();
                if (!next) return;
                const Ask ask = std::move(next->second.waiting.front());
                next->second.waiting.pop_front();
                next->second.had++;
                next->second.turn = ++lane.turns;
                ask(std::make_shared<const Ticket>(*this, name, next->first));
            }
        });
    }

    boost::asio::io_context& io_;
    std::map<std::string, Lane> lanes_;
    bool closed_ = false;
};

}  // namespace tessera
