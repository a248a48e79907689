(* Factors that a certificate leaves out. Floating point proposes; whether one shows anything, the extracted checker
   decides. *)

let to_float (m, e) =
  let excess = max 0 (Z.numbits m - 64) in
  Float.ldexp (Z.to_float (Z.shift_right m excess)) (Z.to_int e + excess)

(* s with 2^(2 s) x of order one. *)
let scale (m, e) =
  if Z.sign m <= 0 then 0 else
  let magnitude = Z.numbits m + Z.to_int e in
  - ((magnitude + if magnitude > 0 then 1 else 0) / 2)

(* R with R R' = P - shift I from the lower rows of P, which begin in column first.(i); rows with an empty diagonal stay
   empty. Nothing where that breaks down. *)
let factorised rows first shift =
  let n = Array.length rows in
  let r = Array.map Array.copy rows in
  let works = ref true in
  for i = 0 to n - 1 do
    let row = r.(i) and empty = rows.(i).(i - first.(i)) = 0. in
    if empty then Array.fill row 0 (Array.length row) 0.
    else if !works then
      for j = first.(i) to i do
        let other = r.(j) in
        let rest = ref (if i = j then row.(j - first.(i)) -. shift else row.(j - first.(i))) in
        for k = max first.(i) first.(j) to j - 1 do
          rest := !rest -. row.(k - first.(i)) *. other.(k - first.(j))
        done;
        let pivot = other.(j - first.(j)) in
        if j < i then row.(j - first.(i)) <- (if pivot = 0. then 0. else !rest /. pivot)
        else if !rest > 0. && Float.is_finite !rest then row.(j - first.(i)) <- sqrt !rest
        else works := false
      done
  done;
  if !works then Some r else None

(* Candidates for a factor of P, the closest first. Row i of P begins on the diagonal; zeros follow its end. *)
let factors (p : Proved.dyadic list list) : Proved.factor Seq.t =
  let p = Array.of_list (List.map Array.of_list p) in
  let n = Array.length p in
  let at i j = if i - j < Array.length p.(j) then p.(j).(i - j) else Exact.zero in
  let scales = Array.init n (fun i -> scale (at i i)) in
  let entry i j = let m, e = at i j in to_float (m, Z.add e (Z.of_int (scales.(i) + scales.(j)))) in
  let first = Array.init n (fun i ->
      let j = ref 0 in
      while !j < i && Z.sign (fst (at i !j)) = 0 do incr j done; !j) in
  let rows = Array.init n (fun i -> Array.init (i + 1 - first.(i)) (fun k -> entry i (first.(i) + k))) in
  let sums = Array.make n 0. in
  Array.iteri (fun i row -> Array.iteri (fun k x ->
      sums.(i) <- sums.(i) +. Float.abs x;
      if first.(i) + k < i then sums.(first.(i) + k) <- sums.(first.(i) + k) +. Float.abs x) row) rows;
  let widest = Array.fold_left Float.max 0. sums in
  let integers i row =
    List.init i (fun _ -> Z.zero)
    @ List.map (fun x -> Z.of_float (Float.round (Float.ldexp x 60))) (Array.to_list row) in
  let rec from shift () =
    if not (shift < 1e-7) then Seq.Nil else
    match factorised rows first shift with
    | None -> Seq.Nil
    | Some r ->
      let found = { Proved.unit0 = Z.of_int (-60); scales = List.map Z.of_int (Array.to_list scales);
                    rows = List.mapi (fun i row -> integers first.(i) row) (Array.to_list r) } in
      Seq.Cons (found, from (shift *. 8.)) in
  from (ldexp (float n +. widest) (-56))  (* an eighth of the first one of the writer, who adds in another order *)
