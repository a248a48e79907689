(* Numbers that folding computes: a double, rounded once to nearest, and a bound on how far off it is. The bounds are
   those of the C++ reader, because they decide which numbers a layer carries. *)

type t = { value : float; radius : float }  (* radius 0: exact *)

(* A weight, or what it folds into, is infinite or no number. *)
exception Not_finite

let exactly value = { value; radius = 0. }
let zero = exactly 0.
let one = exactly 1.
let is_zero x = x.value = 0. && x.radius = 0.
let is_one x = x.value = 1. && x.radius = 0.
let is_at_least_0 x = x.value >= x.radius
let is_finite x = Float.is_finite x.value && Float.is_finite x.radius
let is_float32 x = x.radius = 0. && (let y = Exact.float32 x.value in Float.is_finite y && y = x.value)
let opposite x = { x with value = -. x.value }

let up = 1. +. 0x1p-26
let unit_roundoff = 0x1p-53
let least = 0x1p-1074
(* Below it, the error of a product or quotient may be no double. *)
let tiny = 0x1p-960

(* Exact numbers m 2^e, e a machine integer. *)
let dyadic x =
  if x = 0. then Z.zero, 0
  else if not (Float.is_finite x) then raise Not_finite
  else let fraction, e = Float.frexp x in Z.of_float (Float.ldexp fraction 53), e - 53
let plus (m, e) (n, f) =
  if Z.sign m = 0 then n, f else if Z.sign n = 0 then m, e
  else if e <= f then Z.add m (Z.shift_left n (f - e)), e else Z.add (Z.shift_left m (e - f)) n, f
let product (m, e) (n, f) = Z.mul m n, e + f
let minus a (n, f) = plus a (Z.neg n, f)

(* A sum of numbers and products, which is rounded when it is read. *)
type sum = { total : Z.t * int; spread : float }

let empty = { total = Z.zero, 0; spread = 0. }
let spread_by sum radius = if radius > 0. then (sum.spread +. radius) *. (1. +. 2. *. unit_roundoff) else sum.spread
let add sum x = { total = plus sum.total (dyadic x.value); spread = spread_by sum x.radius }
let add_product sum a b =
  let radius =
    if a.radius > 0. || b.radius > 0. then
      (Float.abs a.value *. b.radius +. Float.abs b.value *. a.radius +. a.radius *. b.radius) *. up +. least
    else 0. in
  let is_tiny = Float.abs (a.value *. b.value) < tiny && a.value <> 0. && b.value <> 0. in
  let radius = if is_tiny then radius +. 2. *. least else radius in
  { total = plus sum.total (product (dyadic a.value) (dyadic b.value)); spread = spread_by sum radius }
let value sum =
  let value = Exact.nearest sum.total in
  let rest, e = minus sum.total (dyadic value) in
  if Z.sign rest = 0 && sum.spread = 0. then exactly value
  else
    let rest = if Z.sign rest = 0 then 0. else Float.max least (Float.abs (Exact.nearest (rest, e))) in
    { value; radius = (rest +. sum.spread) *. up +. least }

let times a b = value (add_product empty a b)
let rounding_of x = Float.abs x *. unit_roundoff +. least
let is_product x a b = Z.sign (fst (minus (product (dyadic a) (dyadic b)) (dyadic x))) = 0

(* a / b for b that is not 0, also within its radius. *)
let divided a b =
  let quotient = a.value /. b.value in
  let is_exact = a.value = 0. || (Float.abs quotient >= tiny && Float.abs a.value >= tiny
                                  && is_product a.value quotient b.value) in
  let radius = if is_exact then 0. else rounding_of quotient in
  if a.radius > 0. || b.radius > 0. then
    let divisor = (Float.abs b.value -. b.radius) *. (1. -. 4. *. unit_roundoff) in
    let largest = Float.abs quotient +. rounding_of quotient in
    { value = quotient; radius = (radius +. (a.radius +. largest *. b.radius) /. divisor) *. up +. least }
  else { value = quotient; radius }

(* Of a number > 0. *)
let square_root a =
  let root = Float.sqrt a.value in
  let is_exact = a.value >= tiny && is_product a.value root root in
  let radius = if is_exact then 0. else rounding_of root in
  if a.radius > 0. then
    { value = root; radius = (radius +. a.radius /. (root *. (1. -. unit_roundoff))) *. up +. least }
  else { value = root; radius }
