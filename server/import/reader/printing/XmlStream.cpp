#include "server/import/reader/printing/XmlStream.h"

#include <expat.h>
#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <utility>

namespace tessera {
namespace {

constexpr std::size_t kLongestTag = std::size_t{4} << 20, kDeepest = 100;

}  // namespace

struct XmlStream::Parser {
    XML_Parser xml = ::XML_ParserCreate(nullptr);
    ~Parser() { ::XML_ParserFree(xml); }
};

XmlStream::XmlStream(XmlReader& reader) : reader_(reader), parser_(std::make_unique<Parser>()) {
    XML_Parser xml = parser_->xml;
    if (xml == nullptr) throw std::bad_alloc();
    ::XML_SetUserData(xml, this);
    ::XML_SetElementHandler(
        xml,
        [](void* self, const XML_Char* name, const XML_Char** attributes) {
            static_cast<XmlStream*>(self)->begin(name, attributes);
        },
        [](void* self, const XML_Char*) { static_cast<XmlStream*>(self)->end(); });
    ::XML_SetCharacterDataHandler(xml, [](void* self, const XML_Char* letters, int count) {
        static_cast<XmlStream*>(self)->reader_.text({letters, static_cast<std::size_t>(count)});
    });
    ::XML_SetEntityDeclHandler(xml, [](void* self, const XML_Char* name, int, const XML_Char*, int, const XML_Char*,
                                       const XML_Char*, const XML_Char*, const XML_Char*) {
        static_cast<XmlStream*>(self)->refuse(
            {ErrorCode::kRefused,
             fmt::format("it declares an entity, '{:.40}': entities may multiply without end, or name other files; "
                         "write out what it stands for",
                         name)});
    });
}

XmlStream::~XmlStream() = default;

void XmlStream::begin(const char* name, const char** attributes) {
    if (refused_) return;
    if (++depth_ > kDeepest)
        return refuse(
            {ErrorCode::kLimit,
             fmt::format("its elements are nested deeper than {} levels: save it again by another program", kDeepest)});
    const XmlAttributes all(attributes);
    all.each([&](const XmlAttributes::Attribute& attribute) {
        constexpr std::string_view kDeclares = "xmlns";
        if (!attribute.name.starts_with(kDeclares)) return;
        const std::string_view rest = attribute.name.substr(kDeclares.size());
        if (!rest.empty() && rest.front() != ':') return;
        declared_.push_back({std::string(rest.substr(rest.empty() ? 0 : 1)), std::string(attribute.value), depth_});
    });
    const std::string_view whole = name;
    reader_.begin(whole.substr(whole.find(':') + 1), all);
}

void XmlStream::end() {
    if (refused_) return;
    reader_.end();
    while (!declared_.empty() && declared_.back().depth == depth_) declared_.pop_back();
    --depth_;
}

std::string_view XmlStream::namespaceOf(std::string_view prefix) const {
    const auto found = std::ranges::find(declared_.rbegin(), declared_.rend(), prefix, &Declared::prefix);
    return found == declared_.rend() ? std::string_view() : std::string_view(found->uri);
}

std::size_t XmlStream::line() const {
    return ::XML_GetCurrentLineNumber(parser_->xml);
}

void XmlStream::refuse(Error error) {
    if (std::exchange(refused_, true)) return;
    error_ = failWith(fmt::format("line {}", line()), error).value();
    ::XML_StopParser(parser_->xml, XML_FALSE);
}

bool XmlStream::feed(ByteSpan piece) {
    if (refused_) return false;
    fed_ += piece.size();
    const XML_Status status = ::XML_Parse(parser_->xml, reinterpret_cast<const char*>(piece.data()),
                                          static_cast<int>(piece.size()), XML_FALSE);
    if (refused_) return false;
    const XML_Error wrong = status == XML_STATUS_OK ? XML_ERROR_NONE : ::XML_GetErrorCode(parser_->xml);
    if (wrong == XML_ERROR_NO_MEMORY) throw std::bad_alloc();
    if (wrong != XML_ERROR_NONE) {
        refuse(
            {ErrorCode::kBadInput, fmt::format("it is no XML that is sound ({}): save the file again, or copy it anew",
                                               ::XML_ErrorString(wrong))});
        return false;
    }
    const XML_Index at = ::XML_GetCurrentByteIndex(parser_->xml);
    if (at >= 0 && fed_ - std::min(fed_, static_cast<std::size_t>(at)) > kLongestTag + piece.size())
        refuse({ErrorCode::kLimit,
                fmt::format("a tag or a remark is longer than {} MiB: save it without", kLongestTag >> 20)});
    return !refused_;
}

Expected<void> XmlStream::finish() {
    if (!refused_ && ::XML_Parse(parser_->xml, "", 0, XML_TRUE) == XML_STATUS_ERROR && !refused_) {
        const XML_Error wrong = ::XML_GetErrorCode(parser_->xml);
        if (wrong == XML_ERROR_NO_MEMORY) throw std::bad_alloc();
        refuse({ErrorCode::kBadInput,
                fed_ == 0 ? std::string("it is empty")
                          : fmt::format("it is cut off within its XML ({}): copy it anew, or save it again",
                                        ::XML_ErrorString(wrong))});
    }
    if (refused_) return tl::unexpected(error_);
    return {};
}

}  // namespace tessera
