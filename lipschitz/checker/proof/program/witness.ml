(* Two points that prove a lower bound, and where the terms stand that do not move. *)

open Refusal
open Json

let box where certificate part =
  match find where "box" certificate with
  | Object boxes ->
    (match List.assoc_opt part boxes with
     | Some box ->
       List.combine (Exact.hex_floats where (find where "lower" box)) (Exact.hex_floats where (find where "upper" box))
     | None -> rejected "%s: no box for %s" where (shown part))
  | _ -> rejected "%s: no box for %s" where (shown part)

let point net certificate where ~in_box part json =
  let values = Exact.hex_floats where json in
  require (List.length values = Functions.inputs net part) "%s: a point of another size" where;
  require (List.for_all (fun x -> Exact.float32 x = x) values) "%s: a coordinate is not a float32" where;
  if in_box then
    require (List.for_all2 (fun x (low, high) -> low <= x && x <= high) values (box where certificate part))
      "%s: a point is outside of the box" where;
  values

(* And in which compositions the function is silent, and whether the theorems have values of all networks that enter. *)
let read net certificate where names ~in_box ~neighbours ~moves json =
  require_keys where [ "x"; "y"; "others" ] json;
  let moved = List.hd names in
  let at key = point net certificate where ~in_box moved (find where key json) in
  let x = at "x" and y = at "y" in
  let other json =
    require_keys (where ^ ".others") [ "network"; "x" ] json;
    let part = text where (find where "network" json) in
    require (List.length names = 2) "%s: slope: terms can only be summed in front of a rho" where;
    require (Functions.starts_with "phi:" part) "%s: slope: %s is not a neighbour" where (shown part);
    part, point net certificate where ~in_box part (find where "x" json) in
  let others = List.map other (list where (find where "others" json)) in
  let here = moved :: List.map fst others in
  let count part = List.length (List.filter (( = ) part) here) in
  require (neighbours = [] || List.for_all (fun part ->
      part = "phi:ground" || List.exists (fun (kind, n) -> part = "phi:" ^ kind && count part <= n) neighbours) here)
    "%s: has more neighbours than listed" where;
  require (List.length names = 1 || count "phi:ground" = (if Functions.has_ground net then 1 else 0))
    "%s: slope: the ground network enters the sum exactly once" where;
  let silent = if List.length names = 1 then [] else Functions.silent net (List.nth names 1) in
  require (not (Proved.is_silent silent (List.map (Functions.index net) here)))
    "%s: slope: the function is 0 among these neighbours" where;
  let differs = List.map2 (fun a b -> a <> b) x y in
  require (List.for_all2 (fun moves differs -> moves || not differs) moves differs)
    "%s: slope: x and y differ in a coordinate that is not in the block" where;
  require (List.mem true differs) "%s: slope: x == y" where;
  let exact = List.map Exact.of_float in
  Proved.By_points (exact x, exact y, List.map (fun (part, x) -> Functions.index net part, exact x) others),
  silent
