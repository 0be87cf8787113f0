/// The bytes of every message, and of what travels in their bodies, as they are kept in tests/data/messages; and the
/// schema that documents them.
///
/// After a change of what goes over the wire: raise kProtocolVersion (common/base/Version.h), then
///     TESSERA_WRITE_BYTES=1 ./build/bin/unit_codec --gtest_filter=MessageBytes.AreAsTheyAreKept
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iomanip>
#include <map>
#include <memory>
#include <sstream>

#include "common/codec/ApplicationCodec.h"
#include "common/codec/ChangeCodec.h"
#include "common/codec/FrameCodec.h"
#include "common/codec/MessageCodec.h"
#include "common/request/Schema.h"
#include "tests/unit/AnyMessage.h"
#include "tests/unit/codec/Samples.h"

namespace tessera {
namespace {

const std::string kKept = TESSERA_SOURCE_DIR "/tests/data/messages/bytes.txt";

std::string hexOf(const Bytes& bytes) {
    std::ostringstream text;
    text << std::hex << std::setfill('0');
    for (const std::byte b : bytes) text << std::setw(2) << static_cast<int>(b);
    return text.str();
}

/// "NUMBER NAME" of a message, or "KIND NAME" of what is in a body, to hexadecimal bytes.
struct KeptBytes {
    unsigned protocol = 0;
    std::map<std::string, std::string> messages;
    bool operator==(const KeptBytes&) const = default;
};

KeptBytes bytesNow() {
    KeptBytes now{kProtocolVersion, {}};
    for (const Message& message : test::sampleMessages()) {
        const MessageInfo& info = infoOf(message);
        const std::string number = (info.number < 10 ? "0" : "") + std::to_string(info.number);
        now.messages[number + " " + std::string(info.name)] = hexOf(encodeMessage(message).joined());
    }
    const auto keep = [&](const std::string& kind, std::string_view name, const Bytes& bytes) {
        now.messages[kind + " " + std::string(name)] = hexOf(bytes);
    };
    const auto nameOfSaid = [](const auto& value) {
        return std::visit([]<typename T>(const T&) { return T::kInfo.name; }, value);
    };
    for (const auto& value : test::everyRequest()) keep("request", nameOfSaid(value), encodeRequest(value));
    for (const auto& value : test::everyAnswer()) keep("answer", nameOfSaid(value), encodeAnswer(value));
    for (const auto& value : test::everyNotice()) keep("notice", nameOfSaid(value), encodeNotice(value));
    keep("list", "00", encodeChangeList(test::richList(test::blobOf(1))));
    keep("frame", "00", encodeFrame(test::someFrame()));
    LightHistogram light;
    for (std::size_t i = 0; i < light.pixels.size(); ++i) light.pixels[i] = static_cast<std::uint32_t>(i * i / 100);
    keep("stats", "00",
         encodeStats({{{"front-0-0", 0.5, 1.5, 3, 4, 5, 6, 7, 8, 2.5, 3.5, 4.5, 9, 10, 11}},
                      5.5,
                      6.5,
                      7.5,
                      12,
                      8.5,
                      {{ObjectId(13), 510.5}},
                      light}));
    return now;
}

KeptBytes readKept() {
    KeptBytes kept;
    std::ifstream file(kKept);
    std::string line;
    while (std::getline(file, line)) {
        std::istringstream words(line);
        std::string number, name, bytes;
        if (line.starts_with("#") || !(words >> number >> name)) continue;
        if (number == "protocol")
            kept.protocol = static_cast<unsigned>(std::stoul(name));
        else if (words >> bytes)
            kept.messages[number + " " + name] = bytes;
    }
    return kept;
}

void writeKept(const KeptBytes& now) {
    std::ofstream file(kKept);
    file << "# One message of each kind (tests/unit/AnyMessage.h: sampleMessage) as its payload on the wire, and what "
            "travels in\n"
            "# the bodies of messages (tests/unit/codec/Samples.h).\n"
            "# Written by unit_codec; tests/unit/codec/MessageBytesTest.cpp says how.\n"
            "protocol "
         << now.protocol << "\n";
    for (const auto& [name, bytes] : now.messages) file << name << " " << bytes << "\n";
}

TEST(MessageBytes, AreAsTheyAreKept) {
    const KeptBytes now = bytesNow();
    const KeptBytes kept = readKept();
    const bool sameBytes = now.messages == kept.messages;
    if (std::getenv("TESSERA_WRITE_BYTES")) {
        ASSERT_TRUE(sameBytes || now.protocol != kept.protocol)
            << "other bytes under protocol " << kept.protocol << ", which peers may speak already: raise "
            << "kProtocolVersion first (or remove " << kKept << ", if nobody speaks it yet)";
        return writeKept(now);
    }
    for (const auto& [name, bytes] : kept.messages) {
        const auto found = now.messages.find(name);
        EXPECT_NE(found, now.messages.end()) << name << " is gone";
        if (found == now.messages.end()) continue;
        EXPECT_EQ(found->second, bytes) << name;
    }
    EXPECT_TRUE(sameBytes) << "messages changed: raise kProtocolVersion (" << now.protocol
                           << "), then write their bytes anew, as this test's first lines say";
    EXPECT_EQ(now.protocol, kept.protocol) << "write the bytes anew, as this test's first lines say";
}

/// What this version says after it has read those bytes.
Expected<Bytes> saidAgain(const std::string& kind, const Bytes& bytes) {
    const ByteSlice slice = share(Bytes(bytes));
    const auto again = [](const auto& decoded, auto&& encode) -> Expected<Bytes> {
        if (!decoded) return tl::unexpected(decoded.error());
        return encode(*decoded);
    };
    if (kind == "request") return again(decodeRequest(slice), encodeRequest);
    if (kind == "answer") return again(decodeAnswer(slice), encodeAnswer);
    if (kind == "notice") return again(decodeNotice(slice), encodeNotice);
    if (kind == "list") return again(decodeChangeList(slice, BlobStore(), AbsentBlobs::kKeepAbsent), encodeChangeList);
    if (kind == "frame") return again(decodeFrame(slice), encodeFrame);
    if (kind == "stats") return again(decodeStats(slice), encodeStats);
    return again(decodeMessage(static_cast<std::uint16_t>(std::stoi(kind)), slice),
                 [](const Message& message) { return encodeMessage(message).joined(); });
}

TEST(MessageBytes, OfEarlierPeersAreUnderstood) {
    for (const auto& [name, hex] : readKept().messages) {
        Bytes bytes;
        for (std::size_t i = 0; i < hex.size(); i += 2)
            bytes.push_back(static_cast<std::byte>(std::stoi(hex.substr(i, 2), nullptr, 16)));
        const auto again = saidAgain(name.substr(0, name.find(' ')), bytes);
        ASSERT_TRUE(again) << name << ": " << again.error().message;
        EXPECT_EQ(*again, bytes) << name;
    }
}

// ---- proto/session.proto is what the descriptions say

namespace pb = google::protobuf;

/// As protoc read it when this was built: "session", "application".
class Schema {
public:
    explicit Schema(const std::string& name) {
        std::ifstream file(TESSERA_BIN_DIR "/../generated/proto/" + name + ".schema", std::ios::binary);
        pb::FileDescriptorSet set;
        if (set.ParseFromIstream(&file) && set.file_size() == 1) file_ = pool_.BuildFile(set.file(0));
    }
    /// "Swap" is a name that generated classes need for themselves.
    [[nodiscard]] const pb::Descriptor* find(std::string_view name) const {
        return file_ ? file_->FindMessageTypeByName(name == "Swap" ? "SwapFrame" : std::string(name)) : nullptr;
    }
    [[nodiscard]] const pb::FileDescriptor* file() const { return file_; }

private:
    pb::DescriptorPool pool_;
    const pb::FileDescriptor* file_ = nullptr;
};

/// What protobuf itself writes of this payload's head are the same bytes, and it knows all of its fields.
void expectHead(pb::DynamicMessageFactory& factory, const pb::Descriptor* head, const Bytes& payload,
                std::string_view name) {
    ASSERT_NE(head, nullptr) << name;
    std::uint32_t headBytes = 0, parts = 0;
    std::memcpy(&headBytes, payload.data(), 4);
    std::memcpy(&parts, payload.data() + 4, 4);
    const std::string ours(reinterpret_cast<const char*>(payload.data()) + 8 + 8 * std::size_t{parts}, headBytes);
    const std::unique_ptr<pb::Message> message(factory.GetPrototype(head)->New());
    ASSERT_TRUE(message->ParseFromString(ours)) << name;
    EXPECT_EQ(message->SerializeAsString(), ours) << name;
    message->DiscardUnknownFields();
    EXPECT_EQ(message->SerializeAsString(), ours) << name << " has fields that the schema does not know";
}

template <typename T>
pb::FieldDescriptor::Type schemaType(FieldForm form) {
    if (form == FieldForm::kText || form == FieldForm::kReason) return pb::FieldDescriptor::TYPE_BYTES;
    if (form == FieldForm::kFixed)
        return std::is_signed_v<T> ? pb::FieldDescriptor::TYPE_SFIXED64 : pb::FieldDescriptor::TYPE_FIXED64;
    if (std::is_same_v<T, bool>) return pb::FieldDescriptor::TYPE_BOOL;
    return sizeof(T) == 8 && !std::is_same_v<T, std::chrono::milliseconds> ? pb::FieldDescriptor::TYPE_UINT64
                                                                           : pb::FieldDescriptor::TYPE_UINT32;
}

template <Described M>
void compare(const Schema& schema) {
    const pb::Descriptor* head = schema.find(M::kInfo.name);
    ASSERT_NE(head, nullptr) << M::kInfo.name;
    int fields = 0;
    const auto expect = [&](int number, std::string_view name, pb::FieldDescriptor::Type type) {
        ++fields;
        const pb::FieldDescriptor* field = head->FindFieldByNumber(number);
        ASSERT_NE(field, nullptr) << M::kInfo.name << " field " << number;
        EXPECT_EQ(field->name(), name) << M::kInfo.name;
        EXPECT_EQ(field->type(), type) << M::kInfo.name << "." << name;
    };
    forEachField<M>([&]<FieldForm Form, typename T>(const MessageField<Form, M, T>& f) {
        if (headFieldsOf(Form) == 0) return;
        const std::string name(f.name);
        if (Form == FieldForm::kHash || Form == FieldForm::kBlob) {
            expect(f.number, name + "_low", pb::FieldDescriptor::TYPE_FIXED64);
            expect(f.number + 1, name + "_high", pb::FieldDescriptor::TYPE_FIXED64);
            if (Form == FieldForm::kBlob) expect(f.number + 2, name + "_bytes", pb::FieldDescriptor::TYPE_UINT64);
        } else if (Form == FieldForm::kList) {
            expect(f.number, "sequence", pb::FieldDescriptor::TYPE_UINT64);
            expect(f.number + 1, "state_hash", pb::FieldDescriptor::TYPE_FIXED64);
        } else {
            expect(f.number, name, schemaType<T>(Form));
        }
    });
    EXPECT_EQ(fields, head->field_count()) << M::kInfo.name;
}

TEST(MessageBytes, HaveTheHeadsOfTheSchema) {
    const Schema schema("session");
    ASSERT_NE(schema.file(), nullptr);
    [&]<typename... M>(std::type_identity<std::variant<M...>>) {
        (compare<M>(schema), ...);
    }(std::type_identity<Message>{});
    EXPECT_EQ(static_cast<std::size_t>(schema.file()->message_type_count()), std::variant_size_v<Message>);

    // And what protobuf itself writes for them are the same bytes.
    pb::DynamicMessageFactory factory;
    for (const Message& message : test::sampleMessages())
        expectHead(factory, schema.find(nameOf(message)), encodeMessage(message).joined(), nameOf(message));
}

// ---- proto/application.proto is what the descriptions print

TEST(MessageBytes, TheKeptSchemaOfApplicationsIsWhatTheDescriptionsPrint) {
    std::ifstream file(TESSERA_SOURCE_DIR "/proto/application.proto");
    std::ostringstream kept;
    kept << file.rdbuf();
    EXPECT_EQ(kept.str(), applicationSchema())
        << "print it anew: ./build/bin/tessera-ctl requests --proto > proto/application.proto";
}

TEST(MessageBytes, OfApplicationsHaveTheHeadsOfTheSchema) {
    const Schema schema("application");
    ASSERT_NE(schema.file(), nullptr);
    pb::DynamicMessageFactory factory;
    const auto expectAll = [&](const auto& values, const char* head, const auto& encode) {
        for (const auto& value : values)
            expectHead(factory, schema.find(head), encode(value), head + std::to_string(value.index()));
    };
    expectAll(test::everyRequest(), "RequestHead", encodeRequest);
    expectAll(test::everyAnswer(), "AnswerHead", encodeAnswer);
    expectAll(test::everyNotice(), "NoticeHead", encodeNotice);
}

}  // namespace
}  // namespace tessera
