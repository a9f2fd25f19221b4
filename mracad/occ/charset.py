"""The character set of some texts, detected from their bytes.

Names are short: a file has only a few words beyond ASCII.  So each set that decodes all of them is judged by how likely
its characters are: by the frequency of the character classes of its own standard (first and second level, syllables,
kana), by the characters that are common in names of parts, and for alphabets by their neighbours.  Costs are -log of a
probability, so costs of independent characters add up, and sets whose characters take one, two or four bytes can be
compared.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from math import inf, log

_ASCII = log(60)  # cost of an ASCII character in every set; some use such bytes as the second half of a character
_ENOUGH = 4096  # number of characters that are judged
_BESIDE, _TURN = 2.5, 3.0  # cost of unexpected neighbours, and of unexpected capitals within words
_WEST = "äöüßÄÖÜéèàçêâîôûëïùœÉÈÀÇñóíáúÑøåæØÅÆãõòìÊÂÔ"
_EAST = "ěščřžýáíéúůťďňóąęłńśźżćőűöüĚŠČŘŽÝÁÍÉÚŮŤĎŇÓĄĘŁŃŚŹŻĆŐŰÖÜäÄđĐăâîşţ"
_CYRILLIC = "абвгдежзийклмнопрстуфхцчшщъыьэюяё"
_HANZI = (
    "机身总成左右上下前后盖板架座轴承螺栓钉母垫圈壳体外内零件装配部底支撑臂轮齿箱门面曲线拉伸切除凸台圆角倒孔阵列基准"
    "草图平实电池红绿蓝黑白灰黄色透明中心大小长短管接头法兰密封弹簧销键槽刀具模型标准固定连片条块环套筒杆"
)
_TRADITIONAL = (
    "機身總成左右上下前後蓋板架座軸承螺絲釘母墊圈殼體外內零件裝配組合底支撐臂輪齒箱門面曲線圓角孔基準平電池紅綠藍黑白灰"
    "黃色透明中心大小長短管接頭密封彈簧銷鍵槽刀具模型標準固定連片條塊環套筒桿"
)
_HANGUL = (
    "부품커버상하좌우조립볼트너우징축베어링판프레임케이스몸체기핀홀면형전후내외측단대소지브라켓플랜샤모터블록롤러레가드"
)
_KANJI = "部品組立上下左右前後基板筐体軸受押出形状面固定取付台座筒穴溝歯車外内側壁底蓋箱枠管継手本"
_SIGNS = "°±²³µ–—§·×“”„’‘½¼¾®©«»…"


def detect(texts: Collection[bytes]) -> str:
    """The most likely character set of texts that are not ASCII, by its name in Python; latin-1 where none fits."""
    whole = b" ".join(texts)
    found = {"latin-1": inf}
    for charset in _CHARSETS:
        try:
            found[charset.name] = charset.judged(whole.decode(charset.name)[:_ENOUGH])
        except UnicodeError:
            continue
    return min(found, key=found.__getitem__)


@dataclass(frozen=True)
class _Charset:
    """A character set: the cost of the set itself and of each character, and whether its characters occur among ASCII
    letters."""

    name: str
    rarity: float
    cost: Callable[[str], float]
    latin: bool = False

    def judged(self, text: str) -> float:
        """The cost of a text: how unlikely it is."""
        return self.rarity + sum(map(self._one, " " + text, text))

    def _one(self, before: str, sign: str) -> float:
        if sign.isascii():
            return _ASCII + (_BESIDE if not (self.latin or before.isascii()) and sign.isalpha() else 0.0)
        beside = not before.isascii() if self.latin else before.isascii() and before.isalpha()
        turned = before.islower() and sign.isupper()
        return self.cost(sign) + _BESIDE * beside + _TURN * turned


def _of(share: float, signs: int) -> float:
    """The cost of one of ``signs`` characters that together make up a share of all text."""
    return -log(share / signs)


def _chinese(sign: str) -> float:
    if sign in _HANZI:
        return _of(0.5, len(_HANZI))
    code = sign.encode("gb18030")
    if len(code) == 4 or code[1] < 0xA1:
        return _of(0.002, 20000)
    if 0xB0 <= code[0] <= 0xD7:  # the first level, which nearly all texts use
        return _of(0.47, 3755)
    if code[0] > 0xD7:
        return _of(0.02, 3008)
    return _of(0.01, 188) if code[0] in (0xA1, 0xA3) else _of(0.001, 1000)


def _traditional(sign: str) -> float:
    if sign in _TRADITIONAL:
        return _of(0.5, len(_TRADITIONAL))
    lead = sign.encode("cp950")[0]
    if 0xA4 <= lead <= 0xC6:
        return _of(0.47, 5401)
    return _of(0.015, 7652) if lead > 0xC6 else _of(0.01, 400)


def _korean(sign: str) -> float:
    if sign in _HANGUL:
        return _of(0.5, len(_HANGUL))
    lead, trail = sign.encode("cp949")
    if trail < 0xA1:
        return _of(0.01, 8822)
    if 0xB0 <= lead <= 0xC8:
        return _of(0.47, 2350)
    return _of(0.01, 4888) if lead > 0xC8 else _of(0.01, 900)


def _japanese(sign: str) -> float:
    if "ぁ" <= sign <= "ん":
        return _of(0.15, 83)
    if "ァ" <= sign <= "ー":
        return _of(0.4, 86)
    if sign in _KANJI:
        return _of(0.2, len(_KANJI))
    code = sign.encode("cp932", errors="replace")
    if len(code) == 1:  # halfwidth
        return _of(0.02, 63)
    if 0x88 <= code[0] <= 0x98:
        return _of(0.2, 2965)
    return _of(0.03, 400) if code[0] < 0x88 else _of(0.01, 3390)


def _cyrillic(sign: str) -> float:
    if sign in _CYRILLIC:
        return _of(0.75, 33)
    return _of(0.2, 33) if sign.lower() in _CYRILLIC else _of(0.02, 60)


def _latin(letters: str) -> Callable[[str], float]:
    def cost(sign: str) -> float:
        if sign in letters:
            return _of(0.8, len(letters))
        if sign.isalpha():
            return _of(0.1, 70)
        return _of(0.05, 40) if sign in _SIGNS else _of(0.005, 40)

    return cost


_CHARSETS = (
    _Charset("cp1252", 0.0, _latin(_WEST), latin=True),
    _Charset("gb18030", 0.5, _chinese),
    _Charset("cp932", 1.0, _japanese),
    _Charset("cp949", 1.5, _korean),
    _Charset("cp950", 1.5, _traditional),
    _Charset("cp1251", 2.0, _cyrillic),
    _Charset("cp1250", 2.0, _latin(_EAST), latin=True),
    _Charset("euc_jp", 2.5, _japanese),
)
