/// All requests that applications may say, as their descriptions have it: `tessera-ctl requests`.
#pragma once

#include <string>

namespace tessera {

/// A request per line; for people.
[[nodiscard]] std::string requestsText();
/// {"protocol","requests":[{"number","name","role","changes","answer","stays_open","brings_arrays","help","fields":[FIELD]}],
/// "answers":[{"number","name","help","fields"}],"notices":[…],"former":[numbers]}. A FIELD is {"name","number" (of the
/// head),
/// "type","unit","least","greatest","or","bounds","words":[…],"help","when","optional","many","part","bytes","fields"};
/// what says nothing is left out.
[[nodiscard]] std::string requestsJson();

}  // namespace tessera
