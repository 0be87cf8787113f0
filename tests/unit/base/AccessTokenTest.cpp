#include <gtest/gtest.h>

#include "common/base/AccessToken.h"

namespace tessera {
namespace {

TEST(AccessToken, IsLongAndNeverTheSame) {
    const std::string a = freshToken(), b = freshToken();
    EXPECT_EQ(a.size(), 43u);
    EXPECT_NE(a, b);
    EXPECT_TRUE(isToken(a));
    EXPECT_TRUE(sameToken(a, a));
    EXPECT_FALSE(sameToken(a, b));
    EXPECT_FALSE(sameToken(a, a.substr(1)));
    for (const std::string& wrong :
         {std::string(), std::string(15, 'a'), std::string(129, 'a'), a + " ", a + "\n", "=" + a})
        EXPECT_FALSE(isToken(wrong)) << wrong;
}

TEST(AccessTokens, TellARoleByItsWord) {
    const AccessTokens tokens = AccessTokens::fresh();
    for (const Role role : {Role::kViewer, Role::kEditor, Role::kOperator})
        EXPECT_EQ(tokens.roleOf(tokens.of(role)), role);
    EXPECT_FALSE(tokens.roleOf(""));
    EXPECT_FALSE(tokens.roleOf(tokens.of(Role::kViewer) + "x"));
    EXPECT_FALSE(AccessTokens().roleOf("")) << "an empty word is nobody's";
    EXPECT_TRUE(AccessTokens().empty());
}

}  // namespace
}  // namespace tessera
