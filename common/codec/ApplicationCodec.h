/// What applications ask and what they are told (proto/application.proto) as the body of Request, Reply and Notice.
#pragma once

#include <functional>
#include <optional>

#include "common/base/ByteSlice.h"
#include "common/base/Error.h"
#include "common/request/Requests.h"

namespace tessera {

/// Why somebody may not say such a request; nothing: they may.
using MayNotAsk = std::function<std::optional<Error>(const RequestInfo&)>;

/// Decoding never crashes whatever the bytes are and takes no memory out of proportion to them. What is out of the
/// bounds of its description is refused, with the member's name. kBadInput, kLimit, kUnsupported (words and requests of
/// another version). Byte fields of what is decoded are slices of `bytes` and keep them.
[[nodiscard]] Bytes encodeRequest(const ApplicationRequest& request);
/// `mayNot` is asked before anything in a request is looked at. Empty: everybody may say all.
[[nodiscard]] Expected<ApplicationRequest> decodeRequest(const ByteSlice& bytes, const ApplicationLimits& limits = {},
                                                         const MayNotAsk& mayNot = nullptr);
[[nodiscard]] Bytes encodeAnswer(const ApplicationAnswer& answer);
[[nodiscard]] Expected<ApplicationAnswer> decodeAnswer(const ByteSlice& bytes, const ApplicationLimits& limits = {});
[[nodiscard]] Bytes encodeNotice(const ApplicationNotice& notice);
[[nodiscard]] Expected<ApplicationNotice> decodeNotice(const ByteSlice& bytes, const ApplicationLimits& limits = {});

}  // namespace tessera
