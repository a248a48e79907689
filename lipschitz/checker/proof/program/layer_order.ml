(* In which order layers are evaluated: as the file or the user states, by the numbers in their names, or because no
   other order fits their shapes. *)

open Refusal

type shape = { name : string; inputs : int; outputs : int }

let is_digit c = c >= '0' && c <= '9'

(* Names compared with their numbers as numbers: the sign, and whether they first differ in a number. *)
let compare_names a b =
  let number text at =
    let first = ref at in
    while !first < String.length text && text.[!first] = '0' do incr first done;
    let last = ref !first in
    while !last < String.length text && is_digit text.[!last] do incr last done;
    String.sub text !first (!last - !first), !last in
  let rec go i j =
    if i >= String.length a || j >= String.length b then compare (String.length a - i) (String.length b - j), false
    else if not (is_digit a.[i] && is_digit b.[j]) then
      if a.[i] <> b.[j] then compare a.[i] b.[j], false else go (i + 1) (j + 1)
    else
      let m, i = number a i and n, j = number b j in
      if m = n then go i j else compare (String.length m, m) (String.length n, n), true in
  go 0 0
let naturally_before a b = fst (compare_names a b) < 0
let numbered_before a b = let sign, by_number = compare_names a b in sign < 0 && by_number

let rec fits = function a :: (b :: _ as rest) -> a.outputs = b.inputs && fits rest | _ -> true
let rec all_numbered = function a :: (b :: _ as rest) -> numbered_before a.name b.name && all_numbered rest | _ -> true

let words layers = String.concat "," (List.map (fun l -> l.name) layers)

exception Enough
(* At most `most` orders that fit; None: the search was too long. *)
let orders ~by_number ~most layers =
  let steps = ref 0 and found = ref [] in
  let rec go chosen rest =
    incr steps;
    if !steps > 100_000 then raise Exit;
    if rest = [] then (found := List.rev chosen :: !found; if List.length !found >= most then raise Enough);
    List.iter (fun layer ->
      let others = List.filter (fun l -> l != layer) rest in
      let follows = match chosen with [] -> true | last :: _ -> last.outputs = layer.inputs in
      let allowed = not by_number || not (List.exists (fun l -> numbered_before l.name layer.name) others) in
      if follows && allowed then go (layer :: chosen) others) rest in
  match go [] layers with () | exception Enough -> Some !found | exception Exit -> None

(* `listing`: what the order in the file means. *)
type listing = Evaluation | Registration | Unordered

let decide path listing ~stated layers =
  let check order = if not (fits order) then bad_input "%s: order: %s does not fit the shapes" path (words order);
      order in
  if stated <> [] then begin
    let find name = match List.find_opt (fun l -> l.name = name) layers with
      | Some l -> l | None -> bad_input "%s: order: the file has no layer \"%s\"" path (shown name) in
    let order = List.map find stated in
    if List.length (List.sort_uniq compare stated) <> List.length stated || List.length order <> List.length layers then
      bad_input "%s: order: name every layer of the file once" path;
    if listing = Evaluation && order <> layers then bad_input
        "%s: order: the file itself states another order: %s" path (words layers);
    check order
  end
  else if listing = Evaluation then check layers
  else
    let natural = List.stable_sort (fun a b -> if naturally_before a.name b.name then
        -1 else if naturally_before b.name a.name then 1 else 0) layers in
    let as_listed order = listing = Unordered || order = layers in
    if all_numbered natural && fits natural && as_listed natural then natural else begin
      let undecided () = bad_input
          "%s: the file does not say in which order its layers are evaluated; name them with --order" path in
      if List.length layers > 256 then undecided ();
      match orders ~by_number:false ~most:2 layers with
      | Some [] -> check natural
      | Some [ only ] -> only
      | _ ->
        (match orders ~by_number:true ~most:2 layers with
         | Some [ only ] when as_listed only -> only
         | _ -> undecided ())
    end
