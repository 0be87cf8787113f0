#include "client/ctl/WireText.h"

#include <nlohmann/json.hpp>

#include <array>

#include "common/base/Blob.h"
#include "common/base/Hash.h"
#include "common/net/FrameHeader.h"
#include "common/request/ApplicationLimits.h"
#include "common/scene/FieldTable.h"
#include "common/session/Messages.h"

namespace tessera {
namespace {

using Json = nlohmann::ordered_json;

/// By their numbers.
constexpr std::array<std::string_view, static_cast<std::size_t>(ErrorCode::kFailed) + 1> kCodes{
    "usage", "bad_input", "not_found", "refused", "limit", "network", "unsupported", "failed"};
constexpr std::array<std::string_view, static_cast<std::size_t>(FieldForm::kList) + 1> kForms{
    "varint", "fixed", "text", "reason", "hash", "blob", "bytes", "records", "list"};

std::string_view partyText(Party party) {
    switch (party) {
        case Party::kServer:
            return "server";
        case Party::kHosts:
            return "hosts";
        case Party::kApplications:
            return "applications";
        case Party::kPeers:
            return "peers";
        case Party::kAnybody:
            break;
    }
    return "anybody";
}

std::string_view channelText(OnChannel on) {
    constexpr std::array<std::string_view, 4> kNames{"", "control", "bulk", "both"};
    return kNames[static_cast<std::size_t>(on)];
}

std::string_view whenText(SaidWhen when) {
    constexpr std::array<std::string_view, 3> kNames{"first", "later", "always"};
    return kNames[static_cast<std::size_t>(when)];
}

template <Described M>
Json messageJson() {
    Json fields = Json::array();
    forEachField<M>([&]<FieldForm Form, typename T>(const MessageField<Form, M, T>& f) {
        Json field{{"name", f.name}, {"form", kForms[static_cast<std::size_t>(Form)]}};
        if (f.number > 0) field["number"] = f.number;
        fields.push_back(std::move(field));
    });
    const MessageInfo& info = M::kInfo;
    return {{"number", info.number},         {"name", info.name},          {"from", partyText(info.from)},
            {"to", partyText(info.to)},      {"on", channelText(info.on)}, {"when", whenText(info.when)},
            {"most_bytes", info.maxPayload}, {"fields", std::move(fields)}};
}

template <typename Variant>
struct All;
template <Described... M>
struct All<std::variant<M...>> {
    static Json messages() { return Json::array({messageJson<M>()...}); }
};

}  // namespace

Json wireJson() {
    const ApplicationLimits application;
    return {{"schema", toHex(schemaHash())},
            {"header", {{"magic", "TSRA"}, {"version", FrameHeader::kVersion}, {"bytes", FrameHeader::kBytes}}},
            {"errors", kCodes},
            {"limits",
             {{"proposal_bytes", limits::kMaxProposalBytes},
              {"upload_bytes", limits::kMaxUploadBytes},
              {"inline_array_bytes", limits::kMaxInlineArrayBytes},
              {"upload_piece_bytes", limits::kUploadPieceBytes},
              {"request_bytes", limits::kMaxRequestBytes},
              {"array_leaf_bytes", kBlobLeafBytes},
              {"names", application.maxNames},
              {"page_nodes", application.maxPageNodes},
              {"text_bytes", application.maxTextBytes}}},
            {"messages", All<Message>::messages()}};
}

}  // namespace tessera
