#include "common/session/Messages.h"

#include <array>

namespace tessera {
namespace {

template <typename Variant>
struct AllInfos;
template <Described... M>
struct AllInfos<std::variant<M...>> {
    static constexpr std::array<MessageInfo, sizeof...(M)> kInfos{M::kInfo...};
};
constexpr auto& kInfos = AllInfos<Message>::kInfos;

// ---- what a description has to be

constexpr bool numbersAndNamesAreUnique() {
    for (std::size_t i = 0; i < kInfos.size(); ++i) {
        if (kInfos[i].number == 0 || kInfos[i].maxPayload == 0) return false;
        for (std::size_t j = 0; j < i; ++j)
            if (kInfos[j].number == kInfos[i].number || kInfos[j].name == kInfos[i].name) return false;
    }
    return true;
}
static_assert(numbersAndNamesAreUnique(), "each message has a number, a name and a bound of its own");

constexpr bool goServerToPeerOrBack() {
    for (const MessageInfo& info : kInfos) {
        const bool toServer = includes(info.from, Party::kPeers) && includes(info.to, Party::kServer);
        const bool fromServer = includes(info.from, Party::kServer) && includes(info.to, Party::kPeers);
        if (!toServer && !fromServer) return false;
    }
    return true;
}
static_assert(goServerToPeerOrBack(), "each message is said by a server to a peer, or the other way round");

/// Stands for a value of any type, to count how many of them make an M.
struct AnyValue {
    template <typename T>
    operator T() const;
};
template <typename M, typename... Values>
constexpr std::size_t memberCount() {
    if constexpr (requires { M{Values{}..., AnyValue{}}; })
        return memberCount<M, Values..., AnyValue>();
    else
        return sizeof...(Values);
}

template <Described M>
constexpr bool everyMemberIsDescribed() {
    return memberCount<M>() == std::tuple_size_v<decltype(M::fields())>;
}
/// What follows the head's fields relies on their order: they are written one after the other, as protobuf would.
template <Described M>
constexpr bool fieldNumbersAscend() {
    int next = 1;
    bool ascend = true;
    forEachField<M>([&]<FieldForm Form, typename T>(const MessageField<Form, M, T>& f) {
        if (headFieldsOf(Form) == 0) return;
        ascend = ascend && f.number >= next;
        next = f.number + headFieldsOf(Form);
    });
    return ascend && next <= kMostHeadFields + 1;
}
template <typename Variant>
struct Checked;
template <Described... M>
struct Checked<std::variant<M...>> {
    static_assert((everyMemberIsDescribed<M>() && ...), "what is not described is not sent");
    static_assert((fieldNumbersAscend<M>() && ...), "head fields are numbered upwards from 1, to 15 at most");
};
template struct Checked<Message>;

}  // namespace

const MessageInfo* findInfo(std::uint16_t number) {
    for (const MessageInfo& info : kInfos)
        if (info.number == number) return &info;
    return nullptr;
}

}  // namespace tessera
