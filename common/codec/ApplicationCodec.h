/// What applications ask and what they are told (proto/application.proto) as the body of Request, Reply and Notice.
#pragma once

#include "common/base/ByteSlice.h"
#include "common/base/Error.h"
#include "common/request/Requests.h"

namespace tessera {

/// Decoding never crashes whatever the bytes are and takes no memory out of proportion to them. What is out of the
/// bounds of its description is refused, with the member's name. kBadInput, kLimit, kUnsupported (words and requests of
/// another version). Byte fields of what is decoded are slices of `bytes` and keep them.
[[nodiscard]] Bytes encodeRequest(const ApplicationRequest& request);
[[nodiscard]] Expected<ApplicationRequest> decodeRequest(const ByteSlice& bytes, const ApplicationLimits& limits = {});
[[nodiscard]] Bytes encodeAnswer(const ApplicationAnswer& answer);
[[nodiscard]] Expected<ApplicationAnswer> decodeAnswer(const ByteSlice& bytes, const ApplicationLimits& limits = {});
[[nodiscard]] Bytes encodeNotice(const ApplicationNotice& notice);
[[nodiscard]] Expected<ApplicationNotice> decodeNotice(const ByteSlice& bytes, const ApplicationLimits& limits = {});

}  // namespace tessera
