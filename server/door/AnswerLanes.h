/// How many requests of one name may be open at once, where their answers are large. The door's thread alone.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace tessera {

/// What an answer takes is known once it is there: of each name it is remembered. Until a first answer has come, and
/// where one was large, the next ones of that name wait for those before them; of many sockets that ask for tens of
/// megabytes each, all would lie here at once.
class AnswerLanes {
public:
    static constexpr std::size_t kLarge = std::size_t{1} << 20, kAtOnce = 2;

    explicit AnswerLanes(boost::asio::io_context& io) : io_(io) {}

    /// Held as long as the request is open.
    class Ticket {
    public:
        Ticket(AnswerLanes& lanes, std::string name) : lanes_(lanes), name_(std::move(name)) {
            ++lanes_.lanes_[name_].open;
        }
        ~Ticket() { lanes_.left(name_); }
        Ticket(const Ticket&) = delete;
        Ticket& operator=(const Ticket&) = delete;
        void answered(std::size_t bytes) const {
            Lane& lane = lanes_.lanes_[name_];
            lane.most = std::max(bytes, lane.most - lane.most / 8);  // after some small ones it is wide again
            lane.answered = true;
        }

    private:
        AnswerLanes& lanes_;
        const std::string name_;
    };

    /// Calls `ask` now, or later: with what has to live until the answer is there.
    void enter(const std::string& name, std::function<void(std::shared_ptr<const Ticket>)> ask) {
        Lane& lane = lanes_[name];
        if (lane.narrow() && lane.open >= kAtOnce) return lane.waiting.push_back(std::move(ask));
        ask(std::make_shared<const Ticket>(*this, name));
    }
    /// Nobody is called any more.
    void close() {
        closed_ = true;
        for (auto& [name, lane] : lanes_) lane.waiting.clear();
    }

private:
    struct Lane {
        std::size_t open = 0, most = 0;
        bool answered = false;
        std::deque<std::function<void(std::shared_ptr<const Ticket>)>> waiting = {};
        [[nodiscard]] bool narrow() const { return !answered || most > kLarge; }
    };
    void left(const std::string& name) {
        --lanes_[name].open;
        if (closed_) return;
        // Not from here: one that is refused at once would let go of the next from within.
        boost::asio::post(io_, [this, name] {
            Lane& lane = lanes_[name];
            while (!closed_ && !lane.waiting.empty() && (!lane.narrow() || lane.open < kAtOnce)) {
                const auto ask = std::move(lane.waiting.front());
                lane.waiting.pop_front();
                ask(std::make_shared<const Ticket>(*this, name));
            }
        });
    }

    boost::asio::io_context& io_;
    std::map<std::string, Lane> lanes_;
    bool closed_ = false;
};

}  // namespace tessera
