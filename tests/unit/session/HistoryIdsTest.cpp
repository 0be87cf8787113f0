// What could be swapped does not compile: sequences, frames, epochs and hashes are types of their own, in every call
// and message that has more than one of them.
#include "common/base/HistoryIds.h"

#include <gtest/gtest.h>

#include <type_traits>

#include "common/session/ClientSession.h"
#include "common/session/ServerSession.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

template <typename To, typename... From>
constexpr bool kTakesNone = (!std::is_convertible_v<From, To> && ...) && (!std::is_constructible_v<To, From> && ...);
static_assert(kTakesNone<Sequence, FrameNumber, Epoch, StateHash>);
static_assert(kTakesNone<FrameNumber, Sequence, Epoch, StateHash>);
static_assert(kTakesNone<Epoch, Sequence, FrameNumber, StateHash>);
static_assert(kTakesNone<StateHash, Sequence, FrameNumber, Epoch>);
static_assert(!std::is_convertible_v<std::uint64_t, Sequence>, "a bare number does not say which it is");
static_assert(!std::is_convertible_v<Sequence, std::uint64_t>);

template <typename A, typename B>
concept Comparable = requires(A a, B b) {
    a == b;
};
static_assert(Comparable<Sequence, Sequence> && !Comparable<Sequence, FrameNumber> && !Comparable<Sequence, StateHash>);

template <typename... Arguments>
concept Applies = requires(ClientSession session, Arguments... arguments) {
    session.applied(arguments...);
};
static_assert(Applies<Sequence, StateHash> && !Applies<StateHash, Sequence> && !Applies<FrameNumber, StateHash>);
template <typename... Arguments>
concept Draws = requires(ClientSession session, Arguments... arguments) {
    session.drawn(arguments..., nullptr);
};
static_assert(Draws<FrameNumber, StateHash> && !Draws<StateHash, FrameNumber> && !Draws<Sequence, StateHash>);
template <typename Frame>
concept Asks = requires(ServerSession session, Frame frame) {
    session.requestImages(std::uint64_t{}, frame);
};
static_assert(Asks<FrameNumber> && !Asks<std::uint64_t> && !Asks<Sequence>);

TEST(HistoryIds, AreCountedOneByOne) {
    EXPECT_EQ((5_seq).next(), 6_seq);
    EXPECT_LT(0_frame, (0_frame).next());
    EXPECT_FALSE(0_seq);
    EXPECT_EQ(toHex(0xab_hash), "00000000000000ab");
}

}  // namespace
}  // namespace tessera
