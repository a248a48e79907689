(** The inequality of one part: increments between two points at which the same neurons are on and off. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Parts Claims Slopes Witness Laws Ranges Relaxation.
Import ListNotations.
Open Scope R_scope.

(** What a sum of pairs of linear forms is worth. *)
Definition worth (ps : list pair_of_forms) (v : list R) : R :=
  fold_right (fun p s => 2 * dotR (reals (fst p)) v * dotR (reals (snd p)) v + s) 0 ps.
Lemma worth_app p q v : worth (p ++ q) v = worth p v + worth q v.
Proof. induction p as [|a p IH]; simpl; [ring|]. rewrite IH. ring. Qed.
Lemma dot_scale_short a u v : dotR (reals (scale_short a u)) v = real a * dotR (reals u) v.
Proof.
  unfold scale_short. destruct (Z.eqb_spec (fst a) 0) as [E|_].
  - assert (real a = 0) as -> by (unfold real; rewrite E; ring). simpl. ring.
  - now rewrite (f_scale mul Rmult real real_mul), dot_scale_l.
Qed.
Lemma real_two : real (1, 1)%Z = 2. Proof. unfold real. simpl. ring. Qed.
Lemma real_minus_one : real (-1, 0)%Z = -1. Proof. unfold real. simpl. ring. Qed.
Lemma form_outer p q v : form (realm (outer_sum_of p q)) v = 2 * dotR (reals p) v * dotR (reals q) v.
Proof.
  revert q v. induction p as [|a p IH]; intros [|b q] [|c v]; simpl; try ring.
  rewrite IH, (f_plus add Rplus real real_add), dot_plus_l, !dot_scale_short, !real_mul, real_two. ring.
Qed.
Lemma form_quadratic ps v : form (realm (quadratic ps)) v = worth ps v.
Proof.
  unfold quadratic. induction ps as [|p ps IH]; simpl; auto.
  now rewrite (f_sum add Rplus real real_add), form_sum, form_outer, IH.
Qed.
Lemma real_half x : real (half x) = real x / 2.
Proof. unfold half. rewrite real_shift. simpl. field. Qed.
Lemma dot_halved u v : dotR (reals (map half u)) v = dotR (reals u) v / 2.
Proof. revert v. induction u as [|a u IH]; intros [|c v]; simpl; try field. rewrite IH, real_half. field. Qed.
Lemma dot_unit n pre a post : length pre = n -> dotR (reals (unit_form n)) (pre ++ a :: post) = a.
Proof.
  intros <-. unfold unit_form. rewrite map_app, real_zeros. simpl. rewrite real_one.
  induction pre as [|c pre IH]; simpl; [ring|]. rewrite IH. ring.
Qed.

Lemma worth_minus_squares ys v : worth (minus_squares ys) v = - square (applyR (realm ys) v).
Proof.
  unfold square. induction ys as [|y ys IH]; simpl; [ring|]. rewrite IH, dot_negated, dot_halved. field.
Qed.
(** The form of a lower triangle. *)
Fixpoint triangle (q : matrixD) (d all : list R) : R :=
  match q, d with
  | r :: q', a :: d' => 2 * a * dotR (reals (half_last r)) all + triangle q' d' all
  | _, _ => 0
  end.
Lemma worth_form s q ys all v :
  worth (form_pairs s q ys all) v = real s * triangle q (applyR (realm ys) v) (applyR (realm all) v).
Proof.
  revert ys. induction q as [|r q IH]; intros [|y ys]; simpl; try ring.
  rewrite IH, (f_scale mul Rmult real real_mul), dot_scale_l, dot_combined. ring.
Qed.
Lemma worth_inputs rho dx post : worth (input_pairs rho (length dx)) (dx ++ post) = real rho * square dx.
Proof.
  unfold input_pairs, square. assert (forall pre, worth (map (fun k => (unit_form k,
    scale mul (half rho) (unit_form k)))
    (seq (length pre) (length dx))) (pre ++ dx ++ post) = real rho * dotR dx dx) as H; [|exact (H [])].
  induction dx as [|a dx IH]; intros pre; simpl; [ring|].
  rewrite (f_scale mul Rmult real real_mul), dot_scale_l, dot_unit, real_half by auto.
  specialize (IH (pre ++ [a])). rewrite app_length, Nat.add_1_r, <- app_assoc in IH. simpl in IH. rewrite IH. field.
Qed.

(** What a line says of signs. *)
Definition sign_holds (l : line) (y : R) : Prop := match l with On => 0 <= y | Off => y <= 0 | Open _ _ _ _ => True end.
Fixpoint signs_hold (ls : list layerD) (lines : list (list line)) (h : list R) : Prop :=
  match ls, lines with
  | [], [] => True
  | (w, c) :: ls', l :: lines' =>
      Forall2 sign_holds l (affine (realm w) (reals c) h)
      /\ signs_hold ls' lines' (map relu (affine (realm w) (reals c) h))
  | _, _ => False
  end.
Lemma signs_of_lines ls lines h : lines_hold ls lines h -> signs_hold ls lines h.
Proof.
  revert lines h. induction ls as [|[w c] ls IH]; intros [|l lines] h; simpl; try tauto. intros [H G]. split; [|auto].
  clear -H. induction H as [|a y l ys Ha H IH]; constructor; auto. destruct a; simpl in *; tauto.
Qed.

(** Of layer k before its ReLU. *)
Fixpoint layer_values (ls : list layerD) (k : nat) (h : list R) : list R :=
  match k, ls with
  | _, [] => []
  | O, (w, c) :: _ => affine (realm w) (reals c) h
  | S k', (w, c) :: ls' => layer_values ls' k' (map relu (affine (realm w) (reals c) h))
  end.
Definition value_at ls (k i : nat) (h : list R) : R := nth i (layer_values ls k h) 0.
Definition same_sign (a b : R) : Prop := (0 <= a /\ 0 <= b) \/ (a <= 0 /\ b <= 0).
Definition same_signs ls x y : Prop := forall k i, same_sign (value_at ls k i x) (value_at ls k i y).
(** What a conflict says at a point, and the increments it is about. *)
Definition sign_of (p : place) : R := if stays_on p then 1 else -1.
Definition excluded ls (c : conflict) (x : list R) : Prop :=
  0 <= real (weight c) /\ 0 <= real (rest c) /\ 0 < real (weight c) + real (rest c) /\
  real (weight c) * (sign_of (first c) * value_at ls (in_layer (first c)) (in_row (first c)) x)
  + real (rest c) * (sign_of (second c) * value_at ls (in_layer (second c)) (in_row (second c)) x) <= 0.
Definition increment_at ls (p : place) (x y : list R) : R :=
  let a := value_at ls (in_layer p) (in_row p) x in let b := value_at ls (in_layer p) (in_row p) y in
  if stays_on p then relu a - relu b else (a - b) - (relu a - relu b).
Lemma increment_vanishes ls p x y : let a := value_at ls (in_layer p) (in_row p) x in
  let b := value_at ls (in_layer p) (in_row p) y in
  sign_of p * a <= 0 -> sign_of p * b <= 0 -> increment_at ls p x y = 0.
Proof.
  unfold increment_at, sign_of. cbv zeta. set (a := value_at _ _ _ x). set (b := value_at _ _ _ y).
  destruct (stays_on p); intros H G; [rewrite !relu_left by lra|rewrite !relu_right by lra]; ring.
Qed.
Lemma excluded_product ls c x y : same_signs ls x y -> excluded ls c x -> excluded ls c y ->
  increment_at ls (first c) x y * increment_at ls (second c) x y = 0.
Proof.
  intros S (Hw & Hr & Hs & Hx) (_ & _ & _ & Hy).
  pose proof (S (in_layer (first c)) (in_row (first c))) as S1.
  pose proof (S (in_layer (second c)) (in_row (second c))) as S2.
  pose proof (increment_vanishes ls (first c) x y) as V1. pose proof (increment_vanishes ls (second c) x y) as V2.
  cbv zeta in V1, V2. unfold same_sign in S1, S2.
  set (a := value_at ls (in_layer (first c)) (in_row (first c)) x) in *.
  set (b := value_at ls (in_layer (first c)) (in_row (first c)) y) in *.
  set (d := value_at ls (in_layer (second c)) (in_row (second c)) x) in *.
  set (e := value_at ls (in_layer (second c)) (in_row (second c)) y) in *.
  set (s := sign_of (first c)) in *. set (t := sign_of (second c)) in *.
  assert ((s * a <= 0 /\ s * b <= 0) \/ (0 <= s * a /\ 0 <= s * b)) as C1
    by (unfold s, sign_of; destruct (stays_on (first c)); lra).
  assert ((t * d <= 0 /\ t * e <= 0) \/ (0 <= t * d /\ 0 <= t * e)) as C2
    by (unfold t, sign_of; destruct (stays_on (second c)); lra).
  destruct C1 as [[C1 C1']|[C1 C1']]; [rewrite V1 by auto; ring|].
  destruct C2 as [[C2 C2']|[C2 C2']]; [rewrite V2 by auto; ring|].
  clearbody a b d e s t. set (A := s * a) in *. set (B := s * b) in *. set (D := t * d) in *. set (E := t * e) in *.
  destruct (Rle_lt_dec (real (weight c)) 0) as [W|W].
  - assert (real (weight c) = 0) as Z by lra. rewrite Z in *. rewrite V2; [ring| |]; nra.
  - rewrite V1; [ring| |]; nra.
Qed.

(** The increments of open neurons, in their order. *)
Fixpoint open_ones (lines : list line) (dz : list R) : list R :=
  match lines, dz with
  | l :: lines', a :: dz' => if is_open l then a :: open_ones lines' dz' else open_ones lines' dz'
  | _, _ => []
  end.
Lemma relu_increment a b : 0 <= (relu a - relu b) * ((a - b) - (relu a - relu b)).
Proof.
  pose proof (slope_increment relu (0, 1) a b relu_slopes) as S. unfold increment_within in S. cbn [fst snd] in S.
  rewrite Rmult_0_l, Rminus_0_r in S. lra.
Qed.
Lemma relu_step_holds lines ts ys n y y' v pre post :
  Forall2 sign_holds lines y -> Forall2 sign_holds lines y' -> Forall (fun t => is_nonnegative t = true) ts ->
  applyR (realm ys) v = minus y y' -> length pre = n ->
  let dz := minus (map relu y) (map relu y') in v = pre ++ open_ones lines dz ++ post ->
  let '(p, z, m) := relu_step lines ts ys n in
  worth p v <= 0 /\ applyR (realm z) v = dz /\ m = length (pre ++ open_ones lines dz).
Proof.
  unfold minus. intros H. revert ts ys n y' pre.
  induction H as [|l a lines y Hl H IH]; intros ts ys n y' pre H' Ht Hy Hp E.
  - inversion H'. subst y'. simpl in *. rewrite app_nil_r. destruct ys; simpl in *; [|discriminate].
    repeat split; auto; lra.
  - inversion H' as [|l' b lines' y'' Hb Hy']. subst l' lines' y' n.
    destruct ys as [|row ys]; simpl in Hy; [discriminate|].
    inversion Hy as [[Hrow Hys]]. clear Hy.
    assert (Forall (fun t => is_nonnegative t = true) (tl ts)) as Ht' by (destruct ts; [constructor|now inversion Ht]).
    assert (0 <= real (hd zero ts)) as Hh.
    { destruct ts; [simpl; rewrite real_zero; lra|inversion Ht; subst; now apply real_nonnegative]. }
    cbn [relu_step]. destruct l as [| |low high s t]; cbn [is_open]; simpl in E, Hl, Hb.
    + specialize (IH (tl ts) ys (length pre) y'' pre Hy' Ht' Hys eq_refl E).
      destruct (relu_step lines (tl ts) ys (length pre)) as [[p z] m]. destruct IH as (I1 & I2 & I3).
      repeat split; auto.
      simpl. rewrite I2, Hrow, !relu_right by auto. reflexivity.
    + specialize (IH (tl ts) ys (length pre) y'' pre Hy' Ht' Hys eq_refl E).
      destruct (relu_step lines (tl ts) ys (length pre)) as [[p z] m]. destruct IH as (I1 & I2 & I3).
      repeat split; auto.
      simpl. rewrite I2, !relu_left by auto. f_equal. ring.
    + set (c := relu a + -1 * relu b) in *.
      specialize (IH (tl ts) ys (S (length pre)) y'' (pre ++ [c]) Hy' Ht' Hys).
      rewrite app_length, Nat.add_1_r, <- !app_assoc in IH. specialize (IH eq_refl E).
      destruct (relu_step lines (tl ts) ys (S (length pre))) as [[p z] m]. destruct IH as (I1 & I2 & I3).
      pose proof (dot_unit (length pre) pre c (open_ones lines (plusR (map relu y) (scaleR (-1) (map relu y''))) ++
        post) eq_refl) as U.
      rewrite <- E in U. simpl. rewrite U. repeat split.
      * rewrite (f_plus add Rplus real real_add), !(f_scale mul Rmult real real_mul), dot_plus_l, !dot_scale_l, U, Hrow,
          real_neg, real_minus_one.
        pose proof (relu_increment a b) as K. replace (relu a - relu b) with c in K by (unfold c; ring).
        pose proof (Rmult_le_pos _ _ Hh K). lra.
      * now rewrite I2.
      * rewrite I3. now rewrite !app_length.
Qed.
(** Forms of the increments of each layer, before and behind its ReLU. *)
Fixpoint rows_hold (ls : list layerD) (all : list (matrixD * matrixD)) (v h h' : list R) : Prop :=
  match ls, all with
  | [], [] => True
  | (w, c) :: ls', (ys, zs) :: all' =>
      let y := affine (realm w) (reals c) h in let y' := affine (realm w) (reals c) h' in
      applyR (realm ys) v = minus y y' /\ applyR (realm zs) v = minus (map relu y) (map relu y')
      /\ rows_hold ls' all' v (map relu y) (map relu y')
  | _, _ => False
  end.
Lemma nth_scaled i a u : nth i (scaleR a u) 0 = a * nth i u 0.
Proof. revert i. induction u as [|b u IH]; intros [|i]; simpl; auto; ring. Qed.
Lemma nth_plus i u v : nth i (plusR u v) 0 = nth i u 0 + nth i v 0.
Proof.
  revert u v. induction i as [|i IH]; intros [|a u] [|b v]; simpl; try ring. apply IH.
Qed.
Lemma nth_minus i u v : nth i (minus u v) 0 = nth i u 0 - nth i v 0.
Proof. unfold minus. rewrite nth_plus, nth_scaled. ring. Qed.
Lemma nth_apply m v i : nth i (applyR (realm m) v) 0 = dotR (reals (nth i m [])) v.
Proof. revert i. induction m as [|r m IH]; intros [|i]; simpl; auto. Qed.
Lemma nth_relu i y : nth i (map relu y) 0 = relu (nth i y 0).
Proof. rewrite <- (relu_left 0) at 1 by lra. apply map_nth. Qed.
Lemma increment_form_holds ls all v h h' p : rows_hold ls all v h h' ->
  dotR (reals (increment_form all p)) v = increment_at ls p h h'.
Proof.
  unfold increment_form, increment_at, value_at. destruct p as [k i o]. simpl. revert ls all h h'.
  induction k as [|k IH]; intros [|[w c] ls] [|[ys zs] all] h h'; simpl; try tauto.
  1,3: intros _; destruct i, o; simpl; rewrite ?relu_left by lra; ring.
  - intros (Hy & Hz & _).
    assert (dotR (reals (nth i zs [])) v = relu (nth i (affine (realm w) (reals c) h) 0)
      - relu (nth i (affine (realm w) (reals c) h') 0)) as Z
      by (rewrite <- nth_apply, Hz, nth_minus, !nth_relu; reflexivity).
    destruct o; auto. rewrite (f_plus add Rplus real real_add), (f_scale mul Rmult real real_mul), dot_plus_l,
      dot_scale_l,
      real_minus_one, Z, <- nth_apply, Hy, nth_minus. ring.
  - intros (_ & _ & H). apply (IH _ _ _ _ H).
Qed.
Lemma conflicts_worth_nothing ls all v x y cs : rows_hold ls all v x y -> same_signs ls x y ->
  Forall (fun c => excluded ls c x /\ excluded ls c y) cs -> worth (conflict_pairs all cs) v = 0.
Proof.
  intros R S H. induction H as [|c cs [Hx Hy] H IH]; simpl; auto.
  rewrite IH, (f_scale mul Rmult real real_mul), dot_scale_l.
  rewrite !(increment_form_holds ls all v x y) by auto. pose proof (excluded_product ls c x y S Hx Hy) as P.
  set (a := increment_at ls (first c) x y) in *. set (b := increment_at ls (second c) x y) in *.
  replace (2 * (real (neg (times_product c)) * a) * b + 0) with (2 * real (neg (times_product c)) * (a * b)) by ring.
  rewrite P. ring.
Qed.
Lemma apply_times w rows v : applyR (realm (times_rows w rows)) v = applyR (realm w) (applyR (realm rows) v).
Proof.
  unfold times_rows, apply at 1. rewrite !map_map. unfold apply at 1. rewrite map_map. apply map_ext. intros r.
  apply dot_combined.
Qed.
(** From h and h' on there is a vector of increments that begins with those so far. *)
Lemma chain_holds ls lines ts rows h h' pre (last : layerD) :
  signs_hold ls lines h -> signs_hold ls lines h' ->
  Forall (fun l : layerD => length (snd l) = length (fst l)) ls ->
  Forall (Forall (fun t => is_nonnegative t = true)) ts ->
  (forall post w, applyR w (applyR (realm rows) (pre ++
    post)) = applyR w (minus h h')) -> length (snd last) = length (fst last) ->
  let '(p, z, all) := chain_pairs ls lines ts rows (length pre) in
  exists post, worth p (pre ++ post) <= 0 /\ rows_hold ls all (pre ++ post) h h' /\
    applyR (realm (times_rows (fst last) z)) (pre ++ post) =
      minus (network (relu_layers ls) (real_layer last) h) (network (relu_layers ls) (real_layer last) h').
Proof.
  intros H H' F T R Hl. revert lines ts rows h h' pre H H' T R.
  induction F as [|[w c] ls Hc F IH]; intros [|l lines] ts rows h h' pre H H' T R; simpl in H, H'; try tauto; simpl.
  - exists []. simpl. split; [lra|]. split; [exact I|]. rewrite apply_times, R. symmetry. apply minus_affine. simpl.
    now rewrite !map_length.
  - destruct H as [H G], H' as [H' G']. simpl in Hc.
    set (y := affine (realm w) (reals c) h) in *. set (y' := affine (realm w) (reals c) h') in *.
    assert (forall post, applyR (realm (times_rows w rows)) (pre ++ post) = minus y y') as R'.
    { intros post. rewrite apply_times, R. symmetry. apply minus_affine. now rewrite !map_length. }
    assert (Forall (fun t => is_nonnegative t = true) (hd [] ts)) as T1 by (destruct ts; simpl;
      [constructor|now inversion T]).
    assert (Forall (Forall (fun t => is_nonnegative t = true)) (tl ts)) as T2 by (destruct ts; simpl;
      [constructor|now inversion T]).
    set (dz := minus (map relu y) (map relu y')).
    assert (forall post, let '(p, z, m) := relu_step l (hd [] ts) (times_rows w rows) (length pre) in
      worth p (pre ++ open_ones l dz ++ post) <= 0 /\ applyR (realm z) (pre ++ open_ones l dz ++ post) = dz /\
      m = length (pre ++ open_ones l dz)) as S.
    { intros post. apply (relu_step_holds l (hd [] ts) (times_rows w rows) (length pre) y y' _ pre post); auto. }
    destruct (relu_step l (hd [] ts) (times_rows w rows) (length pre)) as [[p z] m].
    assert (m = length (pre ++ open_ones l dz)) as -> by apply (S []).
    specialize (IH lines (tl ts) z (map relu y) (map relu y') (pre ++ open_ones l dz) G G').
    specialize (IH T2).
    assert (forall post v, applyR v (applyR (realm z) ((pre ++ open_ones l dz) ++ post)) =
      applyR v (minus (map relu y) (map relu y'))) as Z by (intros post v; f_equal; rewrite <- app_assoc; apply S).
    specialize (IH Z).
    destruct (chain_pairs ls lines (tl ts) z (length (pre ++ open_ones l dz))) as [[q out] all].
    destruct IH as (post & I1 & I3 & I2). exists (open_ones l dz ++ post). rewrite <- app_assoc in I1, I2, I3.
    rewrite worth_app. destruct (S post) as (S1 & S2 & _). split; [lra|]. split; [|exact I2]. simpl. repeat split; auto.
Qed.

Lemma shown_sound factor_of tries k p : shown_by factor_of tries k p = true -> nonnegative (realm p).
Proof.
  revert k. induction tries as [|tries IH]; intros k; simpl; [discriminate|].
  destruct (factor_of k p) as [f|]; [|discriminate].
  destruct (shows_nonnegative p f) eqn:E; [intros _|apply IH]. eapply shows_nonnegative_sound; eauto.
Qed.
Lemma split_forall {P : dyadic -> Prop} t (ms : list matrixD) : Forall P t -> Forall (Forall P) (split t ms).
Proof.
  revert t. induction ms as [|m ms IH]; intros t H; simpl; constructor.
  - rewrite <- (firstn_skipn (length m) t) in H. now apply Forall_app in H.
  - apply IH. rewrite <- (firstn_skipn (length m) t) in H. now apply Forall_app in H.
Qed.
(** df' q df or |df|^2. *)
Definition measured (form : option matrixD) (d : list R) : R :=
  match form with None => square d | Some q => triangle q d d end.
Lemma part_holds ls (last : layerD) form moves scale rho lines cs ts x x' : same_signs ls x x' ->
  Forall (fun c => excluded ls c x /\ excluded ls c x') cs ->
  signs_hold ls lines x -> signs_hold ls lines x' -> agree moves x x' -> positive_scale scale = true ->
  Forall (fun l : layerD => length (snd l) = length (fst l)) ls -> length (snd last) = length (fst last) ->
  forallb is_nonnegative ts = true ->
  nonnegative (realm (part_inequality ls last form moves scale rho lines cs ts)) ->
  measured form (minus (network (relu_layers ls) (real_layer last) x) (network (relu_layers ls) (real_layer last) x'))
    <= real rho * square_in scale (minus x x').
Proof.
  intros Same Ex H H' A S F L T. unfold part_inequality. destruct (agree_lengths _ _ _ A) as [Lx Lx'].
  set (dx := minus (movement moves scale x) (movement moves scale x')).
  assert (length dx = count moves) as Ld
    by (unfold dx; rewrite length_minus; rewrite !length_movement; auto).
  rewrite <- Ld. rewrite forallb_forall, <- Forall_forall in T.
  assert (forall post, applyR (realm (selector moves scale)) (dx ++ post) = minus x x') as D.
  { intros post. rewrite <- (selected moves scale x S Lx) at 1. rewrite <- (selected moves scale x' S Lx') at 1.
    rewrite (agree_staying _ _ _ A). unfold dx.
    assert (forall rows, Forall (fun r => length r = count moves) rows -> applyR (realm rows) (dx ++
      post) = applyR (realm rows) dx) as C.
    { intros rows C. unfold apply. rewrite !map_map. apply map_ext_in. intros r Hr. rewrite Forall_forall in C.
      apply dot_app_short. rewrite map_length, (C r Hr), Ld. lia. }
    fold dx. rewrite C.
    - unfold dx at 1. rewrite apply_minus.
      assert (forall u v w, length u = length w -> length v = length w ->
        minus (plusR u w) (plusR v w) = minus u v) as E.
      { clear. unfold minus. induction u as [|a u IH]; intros [|b v] [|c w]; simpl; try discriminate; intros; auto.
        rewrite IH by lia. f_equal. ring. }
      symmetry. apply E; unfold apply; rewrite !map_length, length_selector, length_staying; auto.
    - clear. revert scale. induction moves as [|[|] m IH]; intros scale; simpl; constructor.
      + simpl. now rewrite repeat_length.
      + apply Forall_map. eapply Forall_impl; [|apply IH]. simpl. intros r Hr. now rewrite Hr.
      + apply repeat_length.
      + apply IH. }
  pose proof (chain_holds ls lines (split ts (map fst ls)) (selector moves scale) x x' dx last H H' F
    (split_forall _ _ T) (fun post w => f_equal (applyR w) (D post)) L) as C.
  destruct (chain_pairs ls lines (split ts (map fst ls)) (selector moves scale) (length dx)) as [[p z] all].
  destruct C as (post & C1 & C3 & C2). intros N. specialize (N (dx ++ post)).
  rewrite form_quadratic, !worth_app, worth_inputs, (conflicts_worth_nothing ls all _ x x' cs C3 Same Ex) in N.
  rewrite <- (square_movement moves scale x x' A S). fold dx.
  assert (worth (output_pairs form (times_rows (fst last) z)) (dx ++ post) = - measured form (minus
      (network (relu_layers ls) (real_layer last) x) (network (relu_layers ls) (real_layer last) x'))) as M.
  { rewrite <- C2. destruct form as [q|]; unfold output_pairs; simpl measured.
    - rewrite worth_form, real_minus_one. ring.
    - apply worth_minus_squares. }
  rewrite M in N. lra.
Qed.
Lemma anything_holds ls h : Forall (fun l : layerD => length (snd l) = length (fst l)) ls ->
  signs_hold ls (map anything ls) h.
Proof.
  intros F. revert h. induction F as [|[w c] ls Hc F IH]; intros h; simpl; auto. split; [|apply IH]. simpl in Hc.
  unfold anything. simpl. pose proof (length_affine (realm w) (reals c) h ltac:(now rewrite !map_length)) as E.
  rewrite map_length in E. rewrite <- E. generalize (affine (realm w) (reals c) h). intros y. clear.
  induction y; simpl; constructor; simpl; auto.
Qed.
Lemma units_apply d pre post : applyR (realm (map unit_form (seq (length pre) (length d)))) (pre ++ d ++ post) = d.
Proof.
  revert pre. induction d as [|a d IH]; intros pre; simpl; auto. f_equal; [now apply dot_unit|].
  specialize (IH (pre ++ [a])). rewrite app_length, Nat.add_1_r, <- app_assoc in IH. exact IH.
Qed.
(** What is added to both does not matter. *)
Lemma apply_shifted w u v s : applyR w (minus (plusR u s) (plusR v s)) = applyR w (minus u v).
Proof.
  unfold apply. apply map_ext. intros r. unfold minus. rewrite !(dot_comm r), !dot_plus_l, !dot_scale_l, !dot_plus_l.
  ring.
Qed.
Lemma form_holds p q ts u v s : relu_between p = true -> clamp p = [] -> fits_part p = true ->
  forallb is_nonnegative ts = true -> nonnegative (realm (form_inequality p q ts)) ->
  length u = inputs_of p -> length v = inputs_of p ->
  square (minus (value p (plusR u s)) (value p (plusR v s))) <= triangle q (minus u v) (minus u v).
Proof.
  intros Hr Hc Hf T N L L'. unfold value. rewrite !relu_network, Hc by auto. simpl clamped.
  rewrite forallb_forall, <- Forall_forall in T. set (d := minus u v).
  assert (length d = inputs_of p) as Ld by (unfold d; rewrite length_minus; congruence).
  unfold form_inequality in N. rewrite <- Ld in N.
  pose proof (chain_holds (hidden p) (map anything (hidden p)) (split ts (map fst (hidden p)))
    (map unit_form (seq 0 (length d))) (plusR u s) (plusR v s) d (outer p)) as C.
  assert (Forall (fun l : layerD => length (snd l) = length (fst l)) (hidden p)) as F.
  { apply Forall_forall. intros l Hl. apply (fits_layer p); auto. apply in_or_app. now left. }
  assert (forall post w, applyR w (applyR (realm (map unit_form (seq 0 (length d)))) (d ++ post)) =
    applyR w (minus (plusR u s) (plusR v s))) as U.
  { intros post w. rewrite apply_shifted. f_equal. apply (units_apply d []). }
  specialize (C (anything_holds _ _ F) (anything_holds _ _ F) F (split_forall _ _ T)
    U ltac:(apply (fits_layer p); auto; apply in_or_app; right; now left)).
  destruct (chain_pairs _ _ _ _ _) as [[t z] all]. destruct C as (post & C1 & _ & C2). specialize (N (d ++ post)).
  rewrite form_quadratic, !worth_app, worth_form, worth_minus_squares, C2, real_one in N.
  pose proof (units_apply d [] post) as E. simpl in E. rewrite E in N.
  change (square (minus (network (relu_layers (hidden p)) (real_layer (outer p)) (plusR u s))
    (network (relu_layers (hidden p)) (real_layer (outer p)) (plusR v s))) <= triangle q d d). lra.
Qed.
