/// Messages with something in every field, made from their descriptions: samples, and whatever a peer might say.
#pragma once

#include <array>
#include <chrono>
#include <cstring>
#include <utility>
#include <vector>

#include "common/session/Messages.h"

namespace tessera::test {

/// Fills each field of each message from `source`, which has
///   std::uint64_t number();                        any number
///   std::uint64_t word(std::uint64_t last);        of an enumeration; may be beyond its last
///   std::size_t count();                           of records: few
///   std::string text(); ByteSlice bytes();         short
template <typename Source>
class MessageMaker {
public:
    explicit MessageMaker(Source& source) : source_(source) {}

    /// Message `kind` of the variant.
    [[nodiscard]] Message make(std::size_t kind) { return made(kind, std::make_index_sequence<kKinds>{}); }
    static constexpr std::size_t kKinds = std::variant_size_v<Message>;

    template <Described M>
    [[nodiscard]] M make() {
        M message;
        forEachField<M>([&](const auto& f) { fill(f, message.*f.member); });
        return message;
    }

private:
    template <std::size_t... kinds>
    Message made(std::size_t kind, std::index_sequence<kinds...>) {
        Message message;
        ((kind == kinds ? void(message = make<std::variant_alternative_t<kinds, Message>>()) : void()), ...);
        return message;
    }

    template <FieldForm Form, typename M, typename T>
    void fill(const MessageField<Form, M, T>&, T& value) {
        if constexpr (Form == FieldForm::kVarint || Form == FieldForm::kFixed) {
            number(value);
        } else if constexpr (Form == FieldForm::kText || Form == FieldForm::kReason) {
            value = source_.text();
        } else if constexpr (Form == FieldForm::kHash) {
            value = {source_.number(), source_.number()};
        } else if constexpr (Form == FieldForm::kBlob) {
            value = {{source_.number(), source_.number()}, source_.number()};
        } else if constexpr (Form == FieldForm::kBytes) {
            value = source_.bytes();
        } else if constexpr (Form == FieldForm::kRecords) {
            records(value);
        } else {
            CommittedList list{Sequence(source_.number()), StateHash(source_.number()), source_.bytes(), {}};
            records(list.blobs);
            value = share(std::move(list));
        }
    }
    template <typename T>
    void number(T& value) {
        if constexpr (std::is_enum_v<T>)
            value = static_cast<T>(source_.word(static_cast<std::uint64_t>(lastOf(T{}))));
        else if constexpr (std::is_same_v<T, bool>)
            value = source_.number() % 2 == 1;
        else if constexpr (std::is_same_v<T, std::chrono::milliseconds>)
            value = T(static_cast<typename T::rep>(source_.number() % 10'000));
        else
            value = T(source_.number());
    }
    void records(std::vector<BlobInfo>& blobs) {
        for (std::size_t n = source_.count(); n > 0; --n)
            blobs.push_back({{source_.number(), source_.number()}, source_.number()});
    }
    void records(std::vector<HashEntry>& entries) {
        for (std::size_t n = source_.count(); n > 0; --n) entries.push_back({source_.number(), source_.number()});
    }
    void records(std::vector<InputState>& states) {
        for (std::size_t n = source_.count(); n > 0; --n) {
            InputState state;
            // Every bit pattern is one.
            std::array<std::uint64_t, sizeof state / 8> words;
            for (std::uint64_t& word : words) word = source_.number();
            std::memcpy(static_cast<void*>(&state), words.data(), sizeof state);
            states.push_back(state);
        }
    }

    Source& source_;
};

/// For one message, the same every time: no field is zero or empty, some need all 8 bytes.
class SampleSource {
public:
    /// Odd, so that flags are set.
    std::uint64_t number() {
        ++drawn_;
        return drawn_ % 3 == 0 ? 0x9E3779B97F4A7C15ull * (2 * drawn_ + 1) : 2 * drawn_ + 1;
    }
    std::uint64_t word(std::uint64_t last) { return (last + 1) / 2; }
    std::size_t count() { return 2; }
    std::string text() { return "text " + std::to_string(++drawn_) + " \xc3\xa9"; }
    ByteSlice bytes() {
        Bytes bytes;
        for (std::size_t i = 0; i < 12; ++i) bytes.push_back(static_cast<std::byte>(++drawn_));
        return bytes;
    }

private:
    std::uint64_t drawn_ = 0;
};
[[nodiscard]] inline Message sampleMessage(std::size_t kind) {
    SampleSource source;
    Message message = MessageMaker(source).make(kind);
    if (auto* hello = std::get_if<message::Hello>(&message)) hello->protocol = kProtocolVersion;
    return message;
}
/// One of each kind, in the order of the variant.
[[nodiscard]] inline std::vector<Message> sampleMessages() {
    std::vector<Message> all;
    for (std::size_t kind = 0; kind < std::variant_size_v<Message>; ++kind) all.push_back(sampleMessage(kind));
    return all;
}

}  // namespace tessera::test
