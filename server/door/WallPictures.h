/// What the wall shows now, as files.
#pragma once

#include <boost/asio/io_context.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/wall/Wall.h"
#include "server/door/Beside.h"
#include "server/door/DoorLink.h"
#include "server/door/HttpMessage.h"

namespace tessera {

/// Whoever asks while hosts are asked already gets the same pictures, and so does who asks within kFresh: many who look
/// on cost hosts no more than one. The door's thread; pictures are put together on one of their own, one at a time of a
/// kind: whoever comes meanwhile shares the next one.
class WallPictures {
public:
    static constexpr std::chrono::milliseconds kFresh{100};

    explicit WallPictures(boost::asio::io_context& io) : maker_(io) {}
    /// The mosaic of all screens.
    void wall(DoorLink& link, AnswerHttp answer);
    /// Who waits is told nothing.
    void forget() { waiting_.clear(), ofWall_ = {}, ofWhole_ = {}; }
    /// Of what is being put together.
    void finish() { maker_.finish(); }
    void tile(DoorLink& link, const std::string& name, AnswerHttp answer);
    /// Each pixel of the wall, as a PNG that lies in `folder` without a name while it is sent. Where tiles show
    /// different frames they are asked again.
    void whole(DoorLink& link, const std::string& folder, AnswerHttp answer);

private:
    using Images = std::shared_ptr<const answer::Images>;
    using Waiting = std::function<void(const Expected<Images>&)>;
    using Make = std::function<void(AnswerHttp)>;
    struct Turn {
        std::vector<AnswerHttp> next = {};  ///< who waits for the one behind that which is made
        Make make = {};                     ///< that one
        bool busy = false;
    };
    void images(DoorLink& link, Waiting waiting);
    /// Calls `make(answer)`, for all who wait then, once none of its kind is being made.
    void take(Turn& turn, AnswerHttp answer, Make make);
    void makeWall(DoorLink& link, AnswerHttp answer);
    void makeWhole(DoorLink& link, const std::string& folder, AnswerHttp answer, int attempts);

    Images newest_;
    std::chrono::steady_clock::time_point newestAt_{};
    ByteSlice wall_;  ///< of `newest_`
    std::vector<Waiting> waiting_;
    std::shared_ptr<const std::string> jpeg_;  ///< of `jpegOf_`
    Images jpegOf_;
    Turn ofWall_, ofWhole_;
    Beside maker_;
};

}  // namespace tessera
