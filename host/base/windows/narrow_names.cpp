// Makes std::filesystem::path treat narrow names as UTF-8. libstdc++ 12 converts wide paths to UTF-8, but narrow ones
// by this facet, which does not support UTF-8 with msvcrt.dll. The definitions here replace all those of the library's
// object file, so that the linker does not use it.
#include <codecvt>
#include <locale>

namespace std {

namespace {
const codecvt_utf8_utf16<wchar_t>& utf8() {
  static const codecvt_utf8_utf16<wchar_t> facet(1);  // not deleted by a locale
  return facet;
}
}  // namespace

codecvt_base::result codecvt<wchar_t, char, mbstate_t>::do_out(state_type& state,
                                                               const intern_type* from,
                                                               const intern_type* from_end,
                                                               const intern_type*& from_next,
                                                               extern_type* to, extern_type* to_end,
                                                               extern_type*& to_next) const {
  return utf8().out(state, from, from_end, from_next, to, to_end, to_next);
}

codecvt_base::result codecvt<wchar_t, char, mbstate_t>::do_in(state_type& state,
                                                              const extern_type* from,
                                                              const extern_type* from_end,
                                                              const extern_type*& from_next,
                                                              intern_type* to, intern_type* to_end,
                                                              intern_type*& to_next) const {
  return utf8().in(state, from, from_end, from_next, to, to_end, to_next);
}

int codecvt<wchar_t, char, mbstate_t>::do_encoding() const throw() { return utf8().encoding(); }

int codecvt<wchar_t, char, mbstate_t>::do_length(state_type& state, const extern_type* from,
                                                 const extern_type* end, size_t max) const {
  return utf8().length(state, from, end, max);
}

int codecvt<wchar_t, char, mbstate_t>::do_max_length() const throw() { return utf8().max_length(); }

}  // namespace std
